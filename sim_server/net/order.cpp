#include "sim_server/net/order.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <optional>
#include <thread>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/core/wall_time.h"
#include "common/dds/endpoints.h"
#include "common/dds/find_session.h"
#include "common/messages/epoch.h"
#include "common/messages/session_fields.h"
#include "common/messages/validate.h"
#include "sim_server/step/step_io.h"

namespace sectio {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kOrderPollPeriod = std::chrono::milliseconds(20);
constexpr auto kAllHeard = std::chrono::seconds(2);  // a server that hears the order has said its status meanwhile

// A server as it speaks after the order.
struct Answer {
  ServerStatus status;
  bool told = false;  // it has said an event of the kind that answers this order
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

}  // namespace

void give_order(NetworkOptions network, SessionOrder order, const std::string& name, double patience_s) {
  order.source = microseconds_since_1970();
  if (const std::string flaw = first_flaw(order); !flaw.empty()) throw InputError(name + ": " + flaw);
  find_session(network, patience_s, [] { return false; });
  Endpoints<Reads<SceneInfo, ServerStatus, SessionEvent>, Writes<SessionOrder>> endpoints(network,
                                                                                          "sim_server " + name);
  const std::optional<EventKind> answer_kind = answering_event(order.kind);
  std::map<std::uint64_t, Answer> servers;  // by the beginning of their session
  const auto until =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience_s));
  std::optional<std::size_t> tools;
  // Events are kept for late joiners: answers to earlier orders must have come before this one goes out.
  const auto listen = [&](bool ordered) {
    while (const auto scene = endpoints.take<SceneInfo>()) tools = scene->tools.size();
    while (const auto status = endpoints.take<ServerStatus>()) servers[beginning_of(status->epoch)].status = *status;
    while (const auto event = endpoints.take<SessionEvent>()) {
      if (!ordered || !answer_kind || event->kind != static_cast<std::uint8_t>(*answer_kind)) continue;
      servers[beginning_of(event->epoch)].told = true;
      std::printf("%s\n", event->text.c_str());
    }
  };
  while ((servers.empty() || !tools) && Clock::now() < until) {
    listen(false);
    std::this_thread::sleep_for(kOrderPollPeriod);
  }
  if (servers.empty()) throw InputError("session '" + network.session + "': no server was heard");
  const bool is_of_a_tool = order.kind == OrderKind::freeze || order.kind == OrderKind::thaw;
  if (is_of_a_tool && tools && order.tool_id >= *tools)
    throw InputError(name + ": --tool-id: the scene has " + std::to_string(*tools) +
                     (*tools == 1 ? " instrument" : " instruments") + ", numbered from 0, got " +
                     std::to_string(order.tool_id));
  if (!endpoints.write(order)) throw InputError(name + ": DDS refused to send the order");
  Clock::time_point disobeyed = Clock::now();  // for the last time
  while (Clock::now() < until) {
    listen(true);
    const auto obeying = static_cast<std::uint32_t>(
        std::ranges::count_if(servers, [&](const auto& server) { return obeys(order, server.second); }));
    if (obeying < servers.size()) disobeyed = Clock::now();
    // A standby hears orders, too, and says nothing.
    if (obeying == servers.size() &&
        (obeying >= endpoints.writer<SessionOrder>().readers() || Clock::now() - disobeyed > kAllHeard)) {
      log_info(name + ": " + std::to_string(obeying) + (obeying == 1 ? " server obeys" : " servers obey"));
      return;
    }
    std::this_thread::sleep_for(kOrderPollPeriod);
  }
  throw InputError("session '" + network.session + "': a server did not obey: " + name);
}

}  // namespace sectio
