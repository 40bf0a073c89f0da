#include "sim_server/instruments/scissors.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

constexpr double kEdgeOffset = 0.05;  // w over the length from the pivot to the tips
constexpr double kSwept = 0.35;       // height that the upper blade has swept, over the distance from the pivot

}  // namespace

InstrumentShape scissors_shape(const ToolGeometry& g, const InstrumentState& state) {
  const Vec3 pivot = g.c_tool_m;
  const double length_m = (g.a_tool_m - pivot).norm();
  const Vec3 forward = (g.a_tool_m - pivot).stableNormalized();
  const Vec3 to_back = g.d_tool_m - g.a_tool_m;
  const Vec3 down = (to_back - to_back.dot(forward) * forward).stableNormalized();
  const double height_m = to_back.dot(down);

  const double half_rad = std::max(0.0, state.opening_rad / 2);
  const double sine = std::sin(half_rad), cosine = std::cos(half_rad);
  const double crossing_m = length_m * kEdgeOffset / std::max(sine, kEdgeOffset);
  const Vec3 crossing = pivot + crossing_m * forward;
  InstrumentShape s;
  s.a_tool_m = pivot + length_m * (cosine * forward + sine * down);
  s.b_tool_m = s.c_tool_m = pivot;
  s.d_tool_m = pivot + length_m * (cosine * forward - sine * down);
  s.edge_tip_tool_m = crossing + (height_m + std::tan(state.closes_from_rad / 2) * crossing_m) * down;
  s.edge_heel_tool_m = crossing - (height_m + kSwept * crossing_m) * down;
  s.sharp_side_tool = forward;
  return s;
}

CutDecision scissors_decide(const Situation& s) {
  if (s.jaws == Jaws::closing)
    return s.crossings.edge && s.correct_direction ? CutDecision::cut : CutDecision::push_back;
  return s.jaws == Jaws::opening || !s.crossings.edge ? CutDecision::detect_again : CutDecision::push_back;
}

std::string scissors_flaw(const ToolGeometry& g) {
  constexpr double kShortest_m = 1e-3;
  const Vec3 blade = g.a_tool_m - g.c_tool_m, to_back = g.d_tool_m - g.a_tool_m;
  if (blade.norm() < kShortest_m) return "the blades AC are shorter than 1 mm";
  if (blade.cross(to_back).norm() < 1e-4 * blade.norm()) return "the back of the lower blade, D, is on the line AC";
  return {};
}

InstrumentKind scissors() {
  InstrumentKind s;
  s.name = "scissors";
  // The blades point down by 15 degrees.
  const Vec3 forward(0.9659, 0, -0.2588), down(-0.2588, 0, -0.9659);
  s.geometry = {Vec3::Zero(), -0.12 * forward, -0.04 * forward, 0.004 * down};
  s.shape = scissors_shape;
  s.decide = scissors_decide;
  s.flaw = scissors_flaw;
  s.edge_enters = true;
  s.only_closing = true;
  return s;
}

}  // namespace sectio
