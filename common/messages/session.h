// A session as plain values: its contents, its course and its end (idl/session.idl).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/material/looks.h"
#include "common/material/regions.h"
#include "common/math/camera.h"
#include "common/math/types.h"

namespace sectio {

constexpr std::size_t kMaxBodies = 256;
constexpr std::size_t kMaxTools = 16;
constexpr std::size_t kMaxTaskLines = 64;
constexpr std::size_t kMaxNameBytes = 64;
constexpr std::size_t kMaxEventTextBytes = 256;
constexpr std::size_t kMaxLinkReports = 64;

struct BodyInfo {
  std::string name;
  Vec3 skin_colour = Vec3::Constant(0.6);  // red, green, blue; 0 to 1
  Vec3 wall_colour = Vec3::Constant(0.5);
  Regions regions = {};  // inside the body
  BodySurface surface = BodySurface::tissue;
  std::vector<TissueLayer> layers = {};  // layers in walls, from the skin down; to ascending depths
};

struct ToolInfo {
  std::string name;
  std::string kind = "scalpel";
  std::array<Vec3, 4> abcd_tool_m{Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};  // paper B, figure 3
  double gauge_m = 0;  // between the edges of a U-form blade
};

struct SceneInfo {
  std::uint64_t epoch = 0;  // the server and its term: epoch.h
  std::string session;
  double step_s = 0.001;
  Camera camera;
  std::optional<double> floor_z_m = {};  // a plane on which what falls comes to rest
  // All bodies of the scene. Several servers of one session may have a share each; shares have no body in common.
  std::vector<std::string> world_bodies;
  std::vector<BodyInfo> bodies;   // bodies of this server, then parts that came off; body_id is the index
  std::vector<ToolInfo> tools;    // tools of the scene; tool_id is the index
  std::vector<std::string> task;  // aim of the exercise, in lines for a person; empty: none, or another server has it
};

// Whether both claim the same body. Then one of the servers is a ghost, or should never have been started.
bool overlap(const SceneInfo& a, const SceneInfo& b);

// Values of EventKind (sim_server/world/step_io.h) that viewers tell apart.
constexpr std::uint8_t kCutEnded = 3;
constexpr std::uint8_t kCutRefused = 6;
constexpr std::uint8_t kStepOverrun = 7;
constexpr std::uint8_t kBodySplit = 9;
constexpr std::uint8_t kReleased = 12;
constexpr std::uint8_t kGravityTurned = 15;
constexpr std::uint8_t kBegunAnew = 25;
constexpr std::uint8_t kScoreTold = 26;  // a line of the score
constexpr std::uint8_t kDidNotCut = 28;

struct SessionEvent {
  std::uint64_t epoch = 0;
  std::uint64_t step = 0;
  std::uint8_t kind = 0;  // EventKind of sim_server/world/step_io.h
  std::uint32_t body_id = 0;
  std::uint32_t tool_id = 0;
  std::string text;
};

// Whether both are the same event, perhaps said again by a server that has taken the session over.
bool is_same_event(const SessionEvent& a, const SessionEvent& b);

struct BodyVersion {
  std::uint64_t revision = 0;
  std::uint64_t topology_hash = 0;
  bool operator==(const BodyVersion&) const = default;
};

// The check of a deforming body's model: expected error and cost, and those that are measured.
struct BodyCheck {
  double error_estimate = 0;    // relative; 0: nobody estimated it
  double cpu_estimate = 0;      // processor's time for a second; 0: nobody estimated it
  double cpu = 0;               // measured processor's time for a second, of late; 0: nobody measures
  double stability_margin = 1;  // largest stable step over the step taken, at most 1e9
  double residual_m = 0;        // how far the last sweep of an implicit step still moved something
  double energy_gain_j = 0;     // the most so far, beyond what instruments put in
  std::uint64_t implicit_steps = 0;
  bool asleep = false;  // it rests, and is not stepped
  bool operator==(const BodyCheck&) const = default;

  template <class A>
  void archive(A& a) {
    a(error_estimate, cpu_estimate, cpu, stability_margin, residual_m, energy_gain_j, implicit_steps, asleep);
  }
};

enum class ProgramKind : std::uint8_t { viewer, hand };

// The report of a program on its link: a viewer hears states, a hand hears contact models. Times of 0 are not known.
struct LinkReport {
  std::uint64_t client = 0;
  std::string name;
  ProgramKind kind = ProgramKind::viewer;
  double rate_hz = 0;         // states that it has chosen to hear; poses that it sends
  double came_per_s = 0;      // states, or contact models, that arrived
  double lost_fraction = 0;   // lost share of the pieces that headers of these states named, or of the models
  double late_s = 0;          // how much longer the fastest of the latest states took than the fastest one ever
  double age_median_s = 0;    // age of a state when the viewer takes it, of a pose when the model that answers it comes
  double age_p99_s = 0;       // 99th percentile of the same ages
  double round_trip_s = 0;    // to the server and back, the shortest of late
  double clock_offset_s = 0;  // server clock minus program clock, to within half of the round trip
  double sent_s = 0;          // by a clock of the program that doesn't jump
  double heard_s = 0;         // by the server's clock; the server fills it in
  bool operator==(const LinkReport&) const = default;
};

struct ServerStatus {
  std::uint64_t epoch = 0;
  std::uint64_t step = 0;
  double sim_time_s = 0;
  double step_wall_time_s = 0;  // wall time of the step of the newest state that was sent
  double stability_margin = 1;
  std::uint64_t cuts_made = 0;
  std::uint64_t cuts_refused = 0;
  std::uint64_t samples_refused = 0;
  std::uint32_t viewers = 0;
  std::vector<BodyVersion> bodies;
  Vec3 gravity_target_m_per_s2{0, 0, -9.81};  // gravity turns to this
  std::vector<BodyCheck> checks;              // one a body
  std::vector<LinkReport> link_reports;       // newest report of each program in the last seconds
  double speed = 1;                           // simulated time compared with the clock; 0: paused
  double sent_s = 0;                          // by a clock of the server that doesn't jump: link.h
  std::uint32_t frozen_tools = 0;             // bit t: nobody moves tool t
  double speed_set = 1;                       // the speed at which a paused session goes on; else the same as `speed`
  double ends_s = 0;                          // a record that is played ends at this time; 0: the session is live
};

// `frozen_tools`: see ServerStatus.
constexpr bool is_frozen(std::uint32_t frozen_tools, std::size_t tool_id) {
  return (frozen_tools >> tool_id & 1) != 0;
}

constexpr double kSlowest = 0.01, kFastest = 10;  // speed of a session

enum class OrderKind : std::uint8_t {
  tilt,   // gravity turns there: somebody tilts the patient
  pause,  // no step is made
  go_on,
  set_speed,   // simulated time compared with the clock
  begin_anew,  // bodies and score as they were at first; the try so far is kept
  tell_score,  // the score of the exercise so far is told
  seek,        // the played session goes on from another time
  freeze,      // an instrument stays where it is, whatever its hand does
  thaw,        // it follows its hand again
};

// An order of the person who leads a session, to all of its servers.
struct SessionOrder {
  std::uint64_t source = 0;  // differs with every order
  OrderKind kind = OrderKind::tilt;
  Vec3 gravity_m_per_s2 = Vec3::Zero();  // tilt
  double speed = 1;                      // set_speed
  double sim_time_s = 0;                 // seek
  std::uint32_t tool_id = 0;             // freeze, thaw
};

struct SessionEnd {
  std::uint64_t epoch = 0;
  std::uint64_t step = 0;
  std::string reason;
  std::vector<BodyVersion> bodies;  // final: what every replica must reach
};

}  // namespace sectio
