#include "sim_server/net/status.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <thread>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/dds/endpoints.h"
#include "common/dds/find_session.h"
#include "common/messages/link.h"
#include "common/messages/session.h"
#include "common/messages/session_fields.h"
#include "common/messages/text.h"
#include "sim_server/world/step_io.h"

namespace sectio {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kStatusPollPeriod = std::chrono::milliseconds(20);
constexpr auto kOthers = std::chrono::seconds(1);  // after the first server, for others of the session

// "-" for a number that is not known.
std::string number(double x, bool known) {
  return known ? formatted("%8.3g", x) : "       -";
}

std::string pace_of(double speed) {
  if (speed == 0) return "paused";
  if (speed == 1) return "in real time";
  return formatted("at %.3g times the clock", speed);
}

std::string text_of(const ServerStatus& status, const SceneInfo& scene) {
  std::string text =
      formatted("%.1f s simulated, %s, a step takes %.3g ms of %.3g, %u viewers\n%-20s %8s %8s %8s %8s %8s %8s %8s\n",
                status.sim_time_s, pace_of(status.speed).c_str(), 1e3 * status.step_wall_time_s, 1e3 * scene.step_s,
                status.viewers, "body", "error", "cost", "measured", "margin", "residual", "energy", "implicit");
  for (std::size_t b = 0; b < status.checks.size(); ++b) {
    const BodyCheck& c = status.checks[b];
    const bool planned = c.cpu_estimate > 0;
    text += formatted(
        "%-20s %s %s %8.3g %8.3g %8.3g %8.3g %8llu%s\n", b < scene.bodies.size() ? scene.bodies[b].name.c_str() : "?",
        number(c.error_estimate, planned).c_str(), number(c.cpu_estimate, planned).c_str(), c.cpu, c.stability_margin,
        c.residual_m, c.energy_gain_j, static_cast<unsigned long long>(c.implicit_steps), c.asleep ? "  asleep" : "");
  }
  for (std::size_t t = 0; t < scene.tools.size(); ++t)
    if (is_frozen(status.frozen_tools, t))
      text += "tool " + std::to_string(t) + " is frozen: " + scene.tools[t].name + "\n";
  for (const LinkReport& report : status.link_reports) text += line_of(report) + "\n";
  return text;
}

}  // namespace

std::string status_of_session(NetworkOptions network, double patience_s, bool every_field, const std::string& body) {
  find_session(network, patience_s, [] { return false; });
  Endpoints<Reads<ServerStatus, SceneInfo, SessionEvent>, Writes<>> endpoints(network, "sim_server status");
  std::map<std::uint64_t, ServerStatus> statuses;  // by epoch
  std::map<std::uint64_t, SceneInfo> scenes;
  std::map<std::uint64_t, std::string> refusals;  // by session, in any of its terms: the last one
  const auto has_body = [&](const auto& status) {
    const auto scene = scenes.find(status.first);
    return scene != scenes.end() && std::ranges::count(scene->second.bodies, body, &BodyInfo::name) > 0;
  };
  const auto all_known = [&] {
    for (const auto& [epoch, status] : statuses)
      if (!scenes.contains(epoch)) return false;
    return !statuses.empty() && (body.empty() || std::ranges::any_of(statuses, has_body));
  };
  auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience_s));
  bool heard = false;
  while (Clock::now() < until) {
    while (auto scene = endpoints.take<SceneInfo>()) scenes.insert_or_assign(scene->epoch, std::move(*scene));
    while (auto status = endpoints.take<ServerStatus>()) statuses.insert_or_assign(status->epoch, std::move(*status));
    while (const auto event = endpoints.take<SessionEvent>())
      if (event->kind == static_cast<std::uint8_t>(EventKind::order_refused))
        refusals[name_of_session(event->epoch)] = event->text;
    if (!heard && all_known()) {
      heard = true;
      until = std::min(until, Clock::now() + kOthers);
    }
    std::this_thread::sleep_for(kStatusPollPeriod);
  }
  std::string text;
  for (const auto& [epoch, status] : statuses)
    if (const auto scene = scenes.find(epoch); scene != scenes.end())
      text += every_field ? to_text(scene->second) + "\n" + to_text(status) + "\n" : text_of(status, scene->second);
  if (!every_field)
    for (const auto& [name, refusal] : refusals)
      if (std::ranges::any_of(statuses, [&](const auto& each) { return name_of_session(each.first) == name; }))
        text += "refused last: " + refusal + "\n";
  if (text.empty()) throw InputError("session '" + network.session + "': no server was heard");
  if (!body.empty() && std::ranges::none_of(statuses, has_body))
    throw InputError("--body: session '" + network.session + "': no server has a body '" + body + "'");
  return text;
}

}  // namespace sectio
