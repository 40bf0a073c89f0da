#include "sim_server/trials/hand.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "common/core/formatted.h"
#include "common/math/hash.h"
#include "common/math/solid_angle.h"

namespace sectio {
namespace {

constexpr double kTremorSample_s = 0.005;
constexpr int kTremorSines = 6;
constexpr double kTremorLow_hz = 8, kTremorHigh_hz = 12;
constexpr double kRise_s = 0.5, kAloft_s = 0.6;  // up; over to where it goes down
constexpr double kPause_s = 1;
constexpr double kLeastSaw_m = 0.003, kMostSaw_m = 0.008;
constexpr std::size_t kMoments = 400;                    // moments at which a trace is looked at
constexpr int kEdgeParts = 4;                            // parts into which a cutting edge is divided
constexpr double kLeans = 0.3;                           // cosine to the vertical of one that is lifted along itself
constexpr double kLeastLift_m = 0.02, kClear_m = 0.005;  // at least; above all bodies

// Each use of a seed has numbers of its own, so that one property of a hand leaves the others as they are.
enum class Use : std::uint64_t { shift, turn, tremor, lift, back, pause, saw };

class Random {
 public:
  Random(std::uint64_t seed, Use use) : state_(hash_combine(seed, static_cast<std::uint64_t>(use))) {}
  double between(double low, double high) {
    state_ = mix64(state_);
    return low + (high - low) * static_cast<double>(state_ >> 11) * 0x1p-53;
  }
  Vec3 in_ball(double radius) {
    for (;;) {
      Vec3 p;
      for (double& x : p) x = between(-1, 1);
      if (p.squaredNorm() <= 1) return radius * p;
    }
  }

 private:
  std::uint64_t state_;
};

bool cuts(const ToolSpec& tool) {
  const InstrumentKind& kind = instrument_of(tool.kind);
  const InstrumentShape shape = kind.shape(tool.geometry, {});
  return !tool.trace.empty() && (shape.edge_tip_tool_m - shape.edge_heel_tool_m).norm() > 0;
}

// The middle of the ways of what cuts, or else of all instruments.
Vec3 middle_of(const Scene& scene) {
  for (const bool only_cutting : {true, false}) {
    Vec3 sum = Vec3::Zero();
    std::size_t n = 0;
    for (const ToolSpec& tool : scene.tools) {
      if (only_cutting && !cuts(tool)) continue;
      for (const TracePoint& p : tool.trace) sum += p.pose_world.position_m;
      n += tool.trace.size();
    }
    if (n > 0) return sum / static_cast<double>(n);
  }
  return Vec3::Zero();
}

// Whether a part of the edge is inside a body as it is at rest.
bool is_in_tissue(const ToolSpec& tool, const TracePoint& at, const Scene& scene,
                  const std::vector<Eigen::AlignedBox3d>& boxes_body_m) {
  const InstrumentShape shape = instrument_of(tool.kind).shape(tool.geometry, {tool.intensity, at.opening_rad, 0});
  for (int i = 0; i <= kEdgeParts; ++i) {
    const Vec3 along = i * (shape.edge_heel_tool_m - shape.edge_tip_tool_m) / kEdgeParts;
    const Vec3 p_world = at.pose_world.to_world(shape.edge_tip_tool_m + along);
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
      const TriangleSoup& mesh = scene.bodies[b].mesh;
      const Vec3 p = scene.bodies[b].pose.to_local(p_world);
      if (boxes_body_m[b].contains(p) && is_inside(p, mesh.vertices_body_m, mesh.triangles)) return true;
    }
  }
  return false;
}

std::vector<bool> are_in_tissue(const ToolSpec& tool, const Trace& moments, const Scene& scene) {
  std::vector<Eigen::AlignedBox3d> boxes_body_m(scene.bodies.size());
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    for (const Vec3& vertex : scene.bodies[b].mesh.vertices_body_m) boxes_body_m[b].extend(vertex);
  std::vector<bool> are_in;
  for (const TracePoint& at : moments) are_in.push_back(is_in_tissue(tool, at, scene, boxes_body_m));
  return are_in;
}

double top_of(const Scene& scene) {
  double top_m = -HUGE_VAL;
  for (const BodySpec& body : scene.bodies) {
    for (const Vec3& p : body.mesh.vertices_body_m) top_m = std::max(top_m, body.pose.to_world(p).z());
    for (const Vec3& p : body.tets.vertices_body_m) top_m = std::max(top_m, body.pose.to_world(p).z());
  }
  return top_m;
}

// All instruments wait while some do something of their own.
void delay_all(Scene& scene, double at_s, double for_s, const std::function<Trace(const ToolSpec&)>& instead) {
  for (ToolSpec& tool : scene.tools)
    if (!tool.trace.empty()) tool.trace = cuts(tool) ? instead(tool) : waiting(tool.trace, at_s, for_s);
  for (GravityChange& change : scene.gravity_changes)
    if (change.at_s > at_s) change.at_s += for_s;
  scene.duration_s += for_s;
}

// The fraction of the lead's way at which the i-th of n things happens: within the middle of its share.
double fraction_of(std::uint32_t i, std::uint32_t n, Random& random) {
  return (i + random.between(0.3, 0.7)) / n;
}

// The time before at_s at which a trace was so far from where it is then.
double time_behind(const Trace& trace, double at_s, double back_m) {
  const Vec3 from = pose_at(trace, at_s).position_m;
  double back_s = at_s;
  while (back_s > trace.front().time_s && (pose_at(trace, back_s).position_m - from).norm() < back_m) back_s -= 0.001;
  return back_s;
}

// Does something n times along the way of the first tool that cuts through tissue, the last time first: that moves none
// of those before it.
template <typename Act>
void along_the_way(Scene& scene, std::uint32_t n, Random& when, const Act& act) {
  const auto lead = std::ranges::find_if(scene.tools, cuts);
  if (n == 0 || lead == scene.tools.end()) return;
  const Trace moments = moments_of(lead->trace, kMoments);
  const std::vector<bool> in_tissue = are_in_tissue(*lead, moments, scene);
  for (std::uint32_t i = n; i-- > 0;) act(lead->trace, time_at_path(moments, fraction_of(i, n, when), in_tissue));
}

void lift(Scene& scene, const Hand& hand, std::uint64_t seed) {
  Random when(seed, Use::lift), behind(seed, Use::back);
  const double top_m = top_of(scene);
  along_the_way(scene, hand.lifts, when, [&](const Trace& lead, double at_s) {
    const double resume_s = time_behind(lead, at_s, behind.between(0, hand.back_m));
    delay_all(scene, at_s, kLiftTakes_s + at_s - resume_s, [&](const ToolSpec& tool) {
      const double tip_m = pose_at(tool.trace, at_s).to_world(tool.geometry.a_tool_m).z();
      const Vec3 axis_tool = (tool.geometry.b_tool_m - tool.geometry.a_tool_m).stableNormalized();
      return lifted(tool.trace, at_s, std::max(kLeastLift_m, top_m + kClear_m - tip_m), resume_s, axis_tool);
    });
  });
}

void pause(Scene& scene, const Hand& hand, std::uint64_t seed) {
  Random when(seed, Use::pause);
  along_the_way(scene, hand.pauses, when, [&](const Trace&, double at_s) {
    delay_all(scene, at_s, kPause_s, [&](const ToolSpec& tool) { return waiting(tool.trace, at_s, kPause_s); });
  });
}

void saw(Scene& scene, const Hand& hand, std::uint64_t seed) {
  Random how(seed, Use::saw);
  along_the_way(scene, hand.saws, how, [&](const Trace& lead, double at_s) {
    const double back_s = time_behind(lead, at_s, how.between(kLeastSaw_m, kMostSaw_m));
    delay_all(scene, at_s, 2 * (at_s - back_s), [&](const ToolSpec& tool) { return sawing(tool.trace, at_s, back_s); });
  });
}

// The run goes on as long as before after the hand, and after each turn of gravity: tissue moves no faster than it did.
double duration_at(const Scene& scene, double factor) {
  double hand_s = 0;
  for (const ToolSpec& tool : scene.tools)
    if (!tool.trace.empty()) hand_s = std::max(hand_s, std::min(tool.trace.back().time_s, scene.duration_s));
  double duration_s = scene.duration_s + (factor - 1) * hand_s;
  for (const GravityChange& change : scene.gravity_changes)
    duration_s = std::max(duration_s, scene.duration_s + (factor - 1) * change.at_s);
  return duration_s;
}

}  // namespace

Trace moved(Trace trace, const Motion& motion) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(motion.turn_rad, Vec3::UnitZ()));
  for (TracePoint& p : trace) {
    Pose& pose = p.pose_world;
    pose.position_m = motion.pivot_world_m + turn * (pose.position_m - motion.pivot_world_m) + motion.shift_world_m;
    pose.orientation = turn * pose.orientation;
  }
  return trace;
}

Trace stretched(Trace trace, double factor) {
  for (TracePoint& p : trace) p.time_s *= factor;
  return trace;
}

Trace waiting(const Trace& trace, double at_s, double for_s) {
  Trace result;
  const TracePoint here = point_at(trace, at_s);
  for (const TracePoint& p : trace)
    if (p.time_s < at_s) result.push_back(p);
  for (const double time_s : {at_s, at_s + for_s}) result.push_back({time_s, here.pose_world, here.opening_rad});
  for (const TracePoint& p : trace)
    if (p.time_s > at_s) result.push_back({p.time_s + for_s, p.pose_world, p.opening_rad});
  return result;
}

Trace sawing(const Trace& trace, double at_s, double back_s) {
  const auto from = std::ranges::upper_bound(trace, back_s, {}, &TracePoint::time_s);
  const auto to = std::ranges::lower_bound(trace, at_s, {}, &TracePoint::time_s);
  Trace way(from, std::max(from, to));
  const auto at = [&](double time_s) {
    TracePoint p = point_at(trace, time_s);
    p.time_s = time_s;
    return p;
  };
  way.insert(way.begin(), at(back_s));
  way.push_back(at(at_s));
  const double takes_s = 2 * (at_s - back_s);
  Trace result(trace.begin(), to);
  for (std::size_t i = way.size(); i-- > 0;)
    result.push_back({2 * at_s - way[i].time_s, way[i].pose_world, way[i].opening_rad});
  for (std::size_t i = 1; i < way.size(); ++i)
    result.push_back({way[i].time_s + takes_s, way[i].pose_world, way[i].opening_rad});
  for (const TracePoint& p : trace)
    if (p.time_s > at_s) result.push_back({p.time_s + takes_s, p.pose_world, p.opening_rad});
  return result;
}

Trace trembling(const Trace& trace, double rms_m, std::uint64_t seed) {
  Random random(seed, Use::tremor);
  struct Sine {
    double rad_per_s, phase_rad;
  };
  std::vector<std::array<Sine, 3>> sines(kTremorSines);
  for (auto& of_axes : sines)
    for (Sine& s : of_axes) s = {2 * M_PI * random.between(kTremorLow_hz, kTremorHigh_hz), random.between(0, 2 * M_PI)};
  const double amplitude_m = rms_m * std::sqrt(2.0 / (3 * kTremorSines));  // three axes of independent sines
  Trace result;
  const double begin_s = trace.front().time_s, end_s = trace.back().time_s;
  for (std::size_t i = 0;; ++i) {
    const double time_s = std::min(begin_s + static_cast<double>(i) * kTremorSample_s, end_s);
    TracePoint p = point_at(trace, time_s);
    p.time_s = time_s;
    for (const auto& of_axes : sines)
      for (int k = 0; k < 3; ++k) {
        const Sine& s = of_axes[static_cast<std::size_t>(k)];
        p.pose_world.position_m[k] += amplitude_m * std::sin(s.rad_per_s * time_s + s.phase_rad);
      }
    result.push_back(p);
    if (time_s >= end_s) return result;
  }
}

Trace lifted(const Trace& trace, double at_s, double up_m, double resume_s, const Vec3& axis_tool) {
  const auto up = [&](const Pose& pose) -> Vec3 {
    const Vec3 axis = pose.orientation * axis_tool;
    return axis.z() > kLeans ? Vec3(up_m / axis.z() * axis) : Vec3(0, 0, up_m);
  };
  TracePoint left = point_at(trace, at_s), down = point_at(trace, resume_s);
  left.time_s = at_s;
  Trace result;
  for (const TracePoint& p : trace)
    if (p.time_s < at_s) result.push_back(p);
  result.push_back(left);
  left.pose_world.position_m += up(left.pose_world);
  left.time_s = at_s + kRise_s;
  result.push_back(left);
  down.pose_world.position_m += up(down.pose_world);
  down.time_s = left.time_s + kAloft_s;
  result.push_back(down);
  down.pose_world.position_m -= up(down.pose_world);
  down.time_s = at_s + kLiftTakes_s;
  result.push_back(down);
  for (const TracePoint& p : trace)
    if (p.time_s > resume_s) result.push_back({p.time_s - resume_s + at_s + kLiftTakes_s, p.pose_world, p.opening_rad});
  return result;
}

double time_at_path(const Trace& trace, double fraction, const std::vector<bool>& counts) {
  const auto step_m = [&](std::size_t i) {
    if (!counts.empty() && !(counts[i - 1] && counts[i])) return 0.0;
    return (trace[i].pose_world.position_m - trace[i - 1].pose_world.position_m).norm();
  };
  double length_m = 0;
  for (std::size_t i = 1; i < trace.size(); ++i) length_m += step_m(i);
  if (length_m == 0 && !counts.empty()) return time_at_path(trace, fraction);
  double left_m = fraction * length_m;
  for (std::size_t i = 1; i < trace.size(); ++i) {
    const double step = step_m(i);
    if (step > 0 && left_m <= step)
      return trace[i - 1].time_s + left_m / step * (trace[i].time_s - trace[i - 1].time_s);
    left_m -= step;
  }
  return trace.front().time_s;
}

Scene in_hand(Scene scene, const Hand& hand, std::uint64_t seed) {
  Random turn(seed, Use::turn), shift(seed, Use::shift);
  const Motion motion{middle_of(scene), turn.between(-hand.turn_deg, hand.turn_deg) * M_PI / 180,
                      shift.in_ball(hand.shift_m)};
  const double factor = hand.slower / hand.faster;
  scene.duration_s = duration_at(scene, factor);
  for (ToolSpec& tool : scene.tools) tool.trace = stretched(moved(std::move(tool.trace), motion), factor);
  for (GravityChange& change : scene.gravity_changes) change.at_s *= factor;
  for (Expectation& e : scene.expect)
    if (e.measure->value == &Outcome::touched_s) e.range.low *= factor, e.range.high *= factor;
  pause(scene, hand, seed);
  saw(scene, hand, seed);
  lift(scene, hand, seed);
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    ToolSpec& tool = scene.tools[i];
    if (hand.tremor_m > 0 && !tool.trace.empty())
      tool.trace = trembling(tool.trace, hand.tremor_m, hash_combine(seed, static_cast<std::uint64_t>(i)));
    for (TracePoint& p : tool.trace) p.pose_world.orientation.normalize();
  }
  return scene;
}

std::string to_text(const Hand& hand) {
  std::string text;
  const auto add = [&](const char* format, double value, double usual) {
    if (value == usual) return;
    text += (text.empty() ? "" : ", ") + formatted(format, value);
  };
  add("shift %g mm", 1e3 * hand.shift_m, 0);
  add("turn %g deg", hand.turn_deg, 0);
  add("%g times slower", hand.slower, 1);
  add("%g times faster", hand.faster, 1);
  add("tremor %g mm rms", 1e3 * hand.tremor_m, 0);
  add("lifts %g", hand.lifts, 0);
  add("put down up to %g mm behind", 1e3 * hand.back_m, 0);
  add("pauses %g", hand.pauses, 0);
  add("saws %g", hand.saws, 0);
  return text.empty() ? "exact" : text;
}

}  // namespace sectio
