#include "sim_server/net/live_session.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/log.h"
#include "common/messages/epoch.h"
#include "sim_server/scene/scene_warnings.h"
#include "sim_server/session/run_files.h"
#include "sim_server/session/trace_player.h"

namespace sectio {

LiveSession::LiveSession(const Scene& the_scene, const ServeOptions& the_options)
    : scene(the_scene),
      options(the_options),
      attempt(options.attempt),
      first_lock(attempt > 1 ? std::make_shared<DirectoryLock>(options.directory) : nullptr),
      steps(options.endless ? std::nullopt : std::optional(steps_of(scene, options.steps))),
      progress(steps),
      pace(options.speed) {
  const std::uint64_t last_step = options.until_s < 0 ? kAllSteps : steps_until(options.until_s, scene.step_s);
  const std::string directory = try_directory(options.directory, options.attempt);
  if (options.resume != directory) refuse_unfinished(directory);
  if (!options.record.empty())
    record_file = record_to_write(options.record, options.standby || !options.resume.empty());
  run = options.resume.empty() ? std::make_unique<SessionRun>(scene, directory)
                               : SessionRun::resumed(scene, {options.resume, last_step}, directory, last_epoch);
  if (!options.play.empty()) {
    past.emplace(options.play, *run);
    past->run_unseen(*run, scene.step_s, options.from_s);
    if (time_s() < options.from_s - scene.step_s)
      throw InputError(formatted("--from-s: the session ends at %.2f s", time_s()));
  }
  if (options.until_s >= 0 && run->steps() < last_step)
    run->recorder().warn(formatted("--until-s: the session ends at %.2f s, and goes on from there", time_s()));
  const double duration_s = steps ? std::max(scene.duration_s, static_cast<double>(*steps) * scene.step_s) : HUGE_VAL;
  for (const std::string& text : scene_warnings(scene, duration_s)) run->recorder().warn(text);
  ServerNetOptions net_options;
  net_options.network = options.network;
  for (const ToolSpec& tool : scene.tools)
    net_options.fastest_m_per_s.push_back(options.fastest_m_per_s > 0 ? options.fastest_m_per_s
                                                                      : tool.max_speed_m_per_s);
  net_options.standby = options.standby || last_epoch;
  net_options.inputs = run->inputs();
  if (!options.record.empty()) {
    const std::map<std::string, std::string> metadata{{kRecordHeader, to_json(run->header())}};
    if (record_file != options.record)
      log_warning(options.record + " has a part of the session that was, and stays: what comes is in " + record_file);
    record = std::make_unique<SessionRecord>(record_file, metadata);
  }
  net_options.record = record.get();
  net =
      std::make_unique<ServerNet>(net_options, scene_info_now(scene, run->simulation()), meshes_of(run->simulation()));
  log_info("session '" + options.network.session + "' on domain " + std::to_string(options.network.domain));
}

std::string LiveSession::why_not(const SessionOrder& order) const {
  const bool is_of_motion = order.kind == OrderKind::freeze || order.kind == OrderKind::tilt;
  if (past) return is_of_motion ? "what is played again is as it was" : "";
  if (options.play_traces && order.kind == OrderKind::freeze)
    return "instruments follow the scene's traces (--play-traces)";
  if (order.kind != OrderKind::seek) return "";
  if (!run->inputs()) return std::string(kStays) + "the session keeps no inputs to go back by (--export)";
  return order.sim_time_s > time_s() ? std::string(kStays) + "nobody knows what comes" : "";
}

std::optional<Pace::News> LiveSession::take(const SessionOrder& order) {
  if (order.kind == OrderKind::tilt) input.gravity_m_per_s2 = order.gravity_m_per_s2;
  if (order.kind == OrderKind::freeze || order.kind == OrderKind::thaw) return hold_off(order);
  return pace.take(order);
}

void LiveSession::adopt(const StandingOrders& orders) {
  pace = Pace(orders.speed);
  if (orders.is_paused) pace.take({.kind = OrderKind::pause});
  for (std::uint32_t tool = 0; tool < scene.tools.size(); ++tool)
    if (const bool frozen = is_frozen(orders.frozen_tools, tool); frozen != is_frozen(net->frozen_tools(), tool))
      net->set_frozen(tool, frozen);
  displaced.clear();
}

// Its hand is elsewhere when a tool thaws: it leaves what it is in, and is in the scene anew, at its hand.
std::optional<Pace::News> LiveSession::hold_off(const SessionOrder& order) {
  const bool freezes = order.kind == OrderKind::freeze;
  if (order.tool_id >= scene.tools.size() || freezes == is_frozen(net->frozen_tools(), order.tool_id))
    return std::nullopt;
  net->set_frozen(order.tool_id, freezes);
  const std::string& name = scene.tools[order.tool_id].name;
  if (freezes) return Pace::News{EventKind::instrument_frozen, name + " is frozen where it is"};
  displaced.insert(order.tool_id);
  return Pace::News{EventKind::instrument_thawed, name + " follows its hand again"};
}

Succession LiveSession::succession(std::uint64_t epoch) {
  const Simulation& now = run->simulation();
  return {.epoch = next_term(epoch),
          .scene = scene_info_now(scene, now),
          .meshes = meshes_of(now),
          .steps = run->steps(),
          .inputs = run->inputs(),
          .record = record.get()};
}

LiveSession::Try LiveSession::another_try(double from_s) const {
  const std::string& root = options.directory;
  Try next;
  next.attempt = free_try_after(root, attempt);
  const std::string directory = try_directory(root, next.attempt);
  std::error_code unknown;
  const bool is_new = !directory.empty() && !std::filesystem::exists(directory, unknown) && !unknown;
  try {
    if (past || from_s <= 0) {
      next.run = std::make_unique<SessionRun>(scene, directory);
    } else {
      const auto last_step = steps_until(from_s, scene.step_s);
      log_info("running " + std::to_string(last_step) + " steps again");
      std::optional<std::uint64_t> former_epoch;
      next.run = SessionRun::resumed(scene, {try_directory(root, attempt), last_step}, directory, former_epoch);
    }
    if (past) {
      next.past.emplace(options.play, *next.run);
      next.past->run_unseen(*next.run, scene.step_s, from_s);
    }
  } catch (...) {
    if (is_new) std::filesystem::remove_all(directory, unknown);
    throw;
  }
  return next;
}

std::unique_ptr<SessionRun> LiveSession::begin(Try next) {
  attempt = next.attempt;
  std::unique_ptr<SessionRun> former = std::exchange(run, std::move(next.run));
  if (!first_lock) first_lock = former->directory_lock();
  past = std::move(next.past);
  input = {};
  return former;
}

}  // namespace sectio
