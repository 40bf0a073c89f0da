// The viewer: replica, pictures, files. It draws at its own steady rate, independent of the rate of the server.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>
#include <thread>
#include <utility>

#include "common/core/arguments.h"
#include "common/core/log.h"
#include "common/core/report_figures.h"
#include "common/core/stop_signal.h"
#include "common/core/wall_time.h"
#include "common/core/write_file.h"
#include "common/dds/find_session.h"
#include "render_client/net/client_net.h"
#include "render_client/net/session_leader.h"
#include "render_client/net/tip_forces.h"
#include "render_client/screen.h"
#include "render_client/view_record.h"
#include "render_client/viewer_options.h"

namespace sectio {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kEndPatience_s = 5;       // for the final topology, after the server has announced it ...
constexpr double kMostEndPatience_s = 60;  // ... and longer while it comes over a thin link
constexpr double kFinalPicture_s = 0.5;    // how long the last state is shown
constexpr double kForEver_s = 1e9;
constexpr double kMaxRepeat_s = 1;  // a video's picture may stand in so long for those that came too late
constexpr std::size_t kPanelEvents = 5;
constexpr double kHalt_s = 1;     // the viewer itself was halted: no server was silent
constexpr double kCatchUp_s = 3;  // in which it hears them again

// Tells when to stop: the final state of the session has been shown, or the time is over.
class Ending {
 public:
  Ending(double duration_s, double begun_s) : stop_s_(duration_s > 0 ? begun_s + duration_s : 1e300) {}

  bool due(double time_s, const World& world) {
    if (stop_was_requested() || time_s >= stop_s_) return true;
    if (time_s - asked_s_ > kHalt_s) awake_s_ = time_s;
    asked_s_ = time_s;
    if (const std::string bodies = world.left_by(time_s); !bodies.empty() && time_s - awake_s_ > kCatchUp_s) {
      log_error("the server of " + bodies + " fell silent and the others have ended: the session is over");
      return is_whole_ = false, true;
    }
    const std::optional<SessionEnd> end = world.session_end();
    if (!end) return false;
    if (!heard_) last_s_ = std::min(stop_s_, time_s + kMostEndPatience_s);
    heard_ = true;
    if (const std::uint64_t come = come_of(world); come != come_ && !reached_) {
      come_ = come;
      stop_s_ = std::min(last_s_, time_s + kEndPatience_s);
    }
    if (!reached_ && has_reached(*end, world)) {
      stop_s_ = std::min(stop_s_, time_s + kFinalPicture_s);
      reached_ = true;
    }
    return false;
  }
  bool is_whole() const { return is_whole_; }  // each server has told its end, or may yet

 private:
  // Changes with everything that leads to the final topology.
  static std::uint64_t come_of(const World& world) {
    std::uint64_t come = world.pulled_bytes() + 1;
    for (const ReplicaBody* body : world.bodies()) come += body->mesh().revision();
    return come;
  }
  static bool has_reached(const SessionEnd& end, const World& world) {
    const std::vector<const ReplicaBody*> bodies = world.bodies();
    for (std::size_t b = 0; b < bodies.size(); ++b)
      if (bodies[b]->mesh().revision() != end.bodies.at(b).revision) return false;
    return true;
  }

  double stop_s_, last_s_ = 0;
  double asked_s_ = 0, awake_s_ = 0;  // the viewer was halted until then
  std::uint64_t come_ = 0;
  bool heard_ = false;
  bool reached_ = false;
  bool is_whole_ = true;
};

// The session's part of the panel.
PanelView panel_of(const Frame& frame, const World& world, const ClientNet& net, const TipForces& forces) {
  PanelView panel;
  panel.session = frame.session;
  panel.sim_time_s = frame.sim_time_s;
  panel.step_wall_time_s = frame.step_wall_time_s;
  panel.state_age_s = net.state_age_s();
  panel.in_contact = frame.in_contact;
  const std::vector<Equality::OfBody> equality = net.equality().of_bodies(world);
  for (std::size_t b = 0; b < frame.bodies.size(); ++b)
    panel.bodies.push_back(
        {frame.bodies[b].name, frame.bodies[b].revision, b < equality.size() ? equality[b].equal : std::nullopt});
  const double now_s = steady_now_s();
  for (std::uint32_t t = 0; t < frame.tools.size(); ++t)
    panel.instruments.push_back({frame.tools[t].name, frame.tools[t].present, forces.force_n(t, now_s)});
  for (auto event = net.events().rbegin(); event != net.events().rend() && panel.events.size() < kPanelEvents; ++event)
    if (!event->text.empty()) panel.events.insert(panel.events.begin(), event->text);
  return panel;
}

// Gives the orders of the person at the window, in a session that has come so far.
void lead(SessionLeader& leader, const WindowInput& input, double sim_time_s, bool is_paused) {
  leader.poll();
  if (input.pauses) leader.give({.kind = is_paused ? OrderKind::go_on : OrderKind::pause});
  std::optional<double> to_s = input.goes_to_s;
  if (input.goes_back) to_s = std::max(0.0, sim_time_s - kBackInTime_s);
  if (to_s) leader.give({.kind = OrderKind::seek, .sim_time_s = *to_s});
}

// The report, and a line a body on the standard output. Returns the exit code.
int conclude(const ViewerOptions& options, World& world, const ClientNet& net, const ViewRecord& record,
             std::optional<HeardRecord>& heard, const std::string& session, bool saw_any, bool whole) {
  const std::vector<BodyVersion> versions = world.catch_up();
  if (heard) heard->keep(world);
  if (heard && !heard->finish()) whole = false;
  const std::vector<std::string> names = world.body_names();
  const std::vector<std::string> equal = equals_server(versions, world.session_end(), net.equality().of_bodies(world));
  const std::string report = record.json(options.name, world, net.counts(), versions, equal);
  if (!options.report_file.empty() && !try_to_write([&] { write_file(options.report_file, report); })) whole = false;
  bool differs = false;
  for (std::size_t b = 0; b < versions.size(); ++b) {
    differs = differs || equal[b] == "no";
    saw_any = saw_any || equal[b] == "yes";
    std::printf("client %s: body %s revision %llu hash %s equals server: %s\n", options.name.c_str(), names[b].c_str(),
                static_cast<unsigned long long>(versions[b].revision), hash_text(versions[b].topology_hash).c_str(),
                equal[b].c_str());
  }
  if (versions.empty())
    log_error("no server of " + session + " was met");
  else if (!saw_any)
    log_error("no body of " + session + " came whole in that time: its link is thin, or it was there for too short");
  return differs || versions.empty() || !saw_any || !whole ? 1 : 0;
}

int view(ViewerOptions options) {
  catch_stop_signals();
  for (const std::string& file : {options.report_file, options.sheet_file})
    if (!file.empty()) check_can_write(file);  // now, not at the end
  std::optional<HeardRecord> heard;
  if (!options.record_file.empty()) heard.emplace(options.record_file, options.name);
  Screen screen(options);
  const double patience_s = options.duration_s > 0 ? options.duration_s : kForEver_s;
  if (!find_session(options.network, patience_s, stop_was_requested)) return 1;
  ClientNet net(options.network, options.name.substr(0, kMaxNameBytes));
  if (heard) net.record(*heard);
  std::optional<TipForces> forces;
  if (options.window) forces.emplace(options.network);
  std::optional<SessionLeader> leader;
  if (options.lead) leader.emplace(options.network);
  World world;
  Frame frame, halted;
  bool was_halted = false;
  ViewRecord record;
  Ending ending(options.duration_s, steady_now_s());
  bool connected = false, any = false;
  const std::string session =
      "session '" + options.network.session + "' on domain " + std::to_string(options.network.domain);
  log_info("waiting for " + session);

  const double interval_s = 1 / options.frames_per_s;
  double due_s = steady_now_s();
  for (;;) {
    const double sync_begun_s = steady_now_s();
    net.poll(sync_begun_s, world);
    if (ending.due(steady_now_s(), world)) break;
    if (const bool now = net.connected(); now != connected) {
      connected = now;
      log_info(connected ? "connected to a server" : "the server has gone; waiting for it, or for another");
    }
    const bool is_new = world.frame(steady_now_s(), frame);
    if (heard) heard->keep(world);
    record.add_sync(steady_now_s() - sync_begun_s, world);
    if (is_new && !any) log_info("session '" + frame.session + "' on the screen");
    any = any || is_new;
    const double begun_s = steady_now_s();
    const int missed = static_cast<int>(std::clamp((begun_s - due_s) / interval_s, 0.0, kMaxRepeat_s / interval_s));
    if (!screen.listen()) break;
    const bool is_paused = net.speed() == 0;
    if (leader && any) lead(*leader, screen.heard(), frame.sim_time_s, is_paused);
    if (any) {
      if (screen.halted() && !was_halted) halted = frame;
      was_halted = screen.halted();
      Frame& shown = was_halted ? halted : frame;
      if (forces) {
        forces->poll(steady_now_s());
        PanelView panel = panel_of(shown, world, net, *forces);
        if (leader && !world.session_end()) panel.lead = PanelView::Lead{frame.sim_time_s, is_paused};
        screen.set_panel(std::move(panel));
      }
      screen.show(shown, missed, record.pictures_per_s());
      record.add(steady_now_s(), steady_now_s() - begun_s, frame, is_new);
    }
    due_s += (1 + missed) * interval_s;
    if (due_s < steady_now_s() - kMaxRepeat_s) due_s = steady_now_s();
    std::this_thread::sleep_until(Clock::time_point(std::chrono::duration_cast<Clock::duration>(Seconds(due_s))));
  }
  return conclude(options, world, net, record, heard, session, any, screen.finish() && ending.is_whole());
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("render_client", [&] {
    sectio::ViewerOptions options;
    return sectio::parse(argc, argv, options) ? sectio::view(options) : 0;
  });
}
