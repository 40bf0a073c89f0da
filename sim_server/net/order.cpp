#include "sim_server/net/order.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/joined.h"
#include "common/core/log.h"
#include "common/core/unique_id.h"
#include "common/dds/endpoints.h"
#include "common/dds/find_session.h"
#include "common/messages/epoch.h"
#include "common/messages/session_fields.h"
#include "common/messages/validate.h"
#include "sim_server/world/step_io.h"

namespace sectio {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kRepeatPeriod = std::chrono::milliseconds(500);  // a server obeys an order once, however often it comes
constexpr auto kOrderPollPeriod = std::chrono::milliseconds(20);
constexpr auto kAllKnown = std::chrono::milliseconds(500);  // a server that is there has said its status meanwhile
constexpr auto kAllHeard = std::chrono::seconds(2);  // a server that hears the order has said its status meanwhile

// A server as it speaks after the order.
struct Answer {
  ServerStatus status;
  bool told = false;    // it has said an event of the kind that answers this order
  std::string refusal;  // why it doesn't obey; empty: it has not refused
};

// The event that answers an order that no status shows.
std::optional<EventKind> answering_event(OrderKind kind) {
  if (kind == OrderKind::set_speed) return EventKind::speed_set;
  if (kind == OrderKind::begin_anew) return EventKind::begun_anew;
  if (kind == OrderKind::tell_score) return EventKind::score_told;
  if (kind == OrderKind::seek) return EventKind::sought;
  return std::nullopt;
}

bool obeys(const SessionOrder& order, const Answer& answer) {
  switch (order.kind) {
    case OrderKind::tilt:
      return answer.status.gravity_target_m_per_s2 == order.gravity_m_per_s2;
    case OrderKind::pause:
      return answer.status.speed == 0;
    case OrderKind::go_on:
      return answer.status.speed > 0;
    case OrderKind::freeze:
      return is_frozen(answer.status.frozen_tools, order.tool_id);
    case OrderKind::thaw:
      return !is_frozen(answer.status.frozen_tools, order.tool_id);
    case OrderKind::set_speed:
    case OrderKind::begin_anew:
    case OrderKind::tell_score:
    case OrderKind::seek:
      return answer.told;
  }
  return false;
}

using OrderEndpoints = Endpoints<Reads<SceneInfo, ServerStatus, SessionEvent>, Writes<SessionOrder>>;

// The bodies of a scene that a server has, without the parts that have come off.
std::string bodies_of(const SceneInfo& scene) {
  std::vector<std::string> names;
  for (const BodyInfo& body : scene.bodies)
    if (scene.world_bodies.empty() || std::ranges::count(scene.world_bodies, body.name) > 0) names.push_back(body.name);
  return joined(names);
}

// The servers of a session, as they answer an order.
struct Servers {
  void listen(OrderEndpoints& endpoints, bool ordered);
  std::size_t obeying() const {
    return static_cast<std::size_t>(std::ranges::count_if(
        answers, [&](const auto& a) { return a.second.refusal.empty() && obeys(order, a.second); }));
  }
  std::size_t refusing() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(answers, [](const auto& a) { return !a.second.refusal.empty(); }));
  }
  std::string in_words() const;

  SessionOrder order;
  std::map<std::uint64_t, Answer> answers;     // by the beginning of the server's session
  std::map<std::uint64_t, std::string> names;  // bodies of the servers, by the same key
  std::optional<std::size_t> tools;            // number of tools in the scene
};

// Events are kept for late joiners: answers to earlier orders must have come before this one goes out.
void Servers::listen(OrderEndpoints& endpoints, bool ordered) {
  while (const auto scene = endpoints.take<SceneInfo>()) {
    tools = scene->tools.size();
    names[name_of_session(scene->epoch)] = bodies_of(*scene);
  }
  while (const auto status = endpoints.take<ServerStatus>()) answers[name_of_session(status->epoch)].status = *status;
  const std::optional<EventKind> answer_kind = answering_event(order.kind);
  const std::string name = refusal(order, "");
  while (const auto event = endpoints.take<SessionEvent>()) {
    if (!ordered) continue;
    if (event->kind == static_cast<std::uint8_t>(EventKind::order_refused) && event->text.starts_with(name))
      answers[name_of_session(event->epoch)].refusal = event->text.substr(name.size());
    if (!answer_kind || event->kind != static_cast<std::uint8_t>(*answer_kind)) continue;
    answers[name_of_session(event->epoch)].told = true;
    std::printf("%s\n", event->text.c_str());
  }
}

// First the servers that have refused, and why; then the others.
std::string Servers::in_words() const {
  std::string refused, obeyed;
  for (const auto& [beginning, answer] : answers) {
    const auto name = names.find(beginning);
    const std::string who = name == names.end() ? "a server" : "the server of " + name->second;
    if (answer.refusal.empty())
      obeyed += "; " + who + " obeys";
    else
      refused += (refused.empty() ? "refused by " : "; by ") + who + ": " + answer.refusal;
  }
  return refused + obeyed;
}

}  // namespace

bool stands_for(const SessionOrder& later, const SessionOrder& earlier) {
  const auto goes = [](const SessionOrder& order) {
    return order.kind == OrderKind::begin_anew || order.kind == OrderKind::seek;
  };
  if (!goes(later) || !goes(earlier)) return false;
  if (later.kind == OrderKind::begin_anew) return true;
  return earlier.kind == OrderKind::seek && later.sim_time_s <= earlier.sim_time_s;
}

const char* to_string(OrderKind kind) {
  switch (kind) {
    case OrderKind::tilt:
      return "tilt";
    case OrderKind::pause:
      return "pause";
    case OrderKind::go_on:
      return "go-on";
    case OrderKind::set_speed:
      return "speed";
    case OrderKind::begin_anew:
      return "anew";
    case OrderKind::tell_score:
      return "score";
    case OrderKind::seek:
      return "seek";
    case OrderKind::freeze:
      return "freeze";
    case OrderKind::thaw:
      return "thaw";
  }
  return "?";
}

std::string refusal(const SessionOrder& order, const std::string& why) {
  return std::string(to_string(order.kind)) + ": " + why;
}

void give_order(NetworkOptions network, SessionOrder order, double patience_s, const std::string& flag) {
  const std::string name = to_string(order.kind);
  order.source = unique_id(kProgramIdBits);
  if (const std::string flaw = first_flaw(order); !flaw.empty())
    throw InputError(flag.empty() ? name + ": " + flaw : flag + flaw.substr(flaw.find(':')));
  find_session(network, patience_s, [] { return false; });
  OrderEndpoints endpoints(network, "sim_server " + name);
  Servers servers{order, {}, {}, {}};
  const auto begun = Clock::now();
  const auto until = begun + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience_s));
  // A standby hears orders, too, and says nothing.
  const auto all_speak = [&](std::size_t speaking) { return speaking >= endpoints.writer<SessionOrder>().readers(); };
  const auto are_known = [&] {
    return !servers.answers.empty() && servers.tools &&
           (all_speak(servers.answers.size()) || Clock::now() - begun > kAllKnown);
  };
  while (!are_known() && Clock::now() < until) {
    servers.listen(endpoints, false);
    std::this_thread::sleep_for(kOrderPollPeriod);
  }
  if (servers.answers.empty()) throw InputError("session '" + network.session + "': no server was heard");
  const bool is_of_a_tool = order.kind == OrderKind::freeze || order.kind == OrderKind::thaw;
  if (is_of_a_tool && servers.tools && order.tool_id >= *servers.tools)
    throw InputError(name + ": --tool-id: the scene has " + std::to_string(*servers.tools) +
                     (*servers.tools == 1 ? " instrument" : " instruments") + ", numbered from 0, got " +
                     std::to_string(order.tool_id));
  if (!endpoints.write(order)) throw InputError(name + ": DDS refused to send the order");
  Clock::time_point unanswered = Clock::now(), said = unanswered;  // for the last time
  while (Clock::now() < until) {
    servers.listen(endpoints, true);
    const std::size_t obeying = servers.obeying(), refusing = servers.refusing(), answering = obeying + refusing;
    if (answering < servers.answers.size()) unanswered = Clock::now();
    if (answering == servers.answers.size() && (all_speak(answering) || Clock::now() - unanswered > kAllHeard)) {
      if (refusing > 0) throw InputError(name + ": " + servers.in_words());
      log_info(name + ": " + std::to_string(obeying) + (obeying == 1 ? " server obeys" : " servers obey"));
      return;
    }
    if (answering < servers.answers.size() && Clock::now() - said > kRepeatPeriod) {
      said = Clock::now();
      if (!endpoints.write(order)) log_limited(LogLevel::warning, "order", "DDS refused to repeat the order");
    }
    std::this_thread::sleep_for(kOrderPollPeriod);
  }
  if (servers.refusing() > 0) throw InputError(name + ": " + servers.in_words());
  throw InputError(formatted("session '%s': no answer of a server within %.3g s: %s; it may be at work on it, and obey",
                             network.session.c_str(), patience_s, name.c_str()));
}

}  // namespace sectio
