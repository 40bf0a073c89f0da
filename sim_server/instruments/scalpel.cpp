#include "sim_server/instruments/scalpel.h"

namespace sectio {
namespace {

CutDecision scalpel_decide(const Situation& s) {
  if (!s.crossings.ab) return CutDecision::detect_again;
  if (s.crossings.ac) return s.correct_direction ? CutDecision::cut : CutDecision::push_back;
  return s.crossings.bd ? CutDecision::push_out : CutDecision::deform_with_shaft;
}

}  // namespace

InstrumentShape scalpel_shape(const ToolGeometry& g, const InstrumentState&) {
  const Vec3 axis = (g.b_tool_m - g.a_tool_m).stableNormalized();
  const Vec3 towards_c = g.c_tool_m - g.a_tool_m;
  const Vec3 sharp_side = (towards_c - towards_c.dot(axis) * axis).stableNormalized();
  return {g.a_tool_m, g.b_tool_m, g.c_tool_m, g.d_tool_m, g.a_tool_m, g.c_tool_m, sharp_side};
}

std::string corners_flaw(const ToolGeometry& g) {
  constexpr double kShortest_m = 1e-4;
  const auto short_one = [](const Vec3& p, const Vec3& q) { return (q - p).norm() < kShortest_m; };
  const char* name = short_one(g.a_tool_m, g.b_tool_m)   ? "AB"
                     : short_one(g.a_tool_m, g.c_tool_m) ? "AC"
                     : short_one(g.c_tool_m, g.d_tool_m) ? "CD"
                                                         : nullptr;
  return name ? std::string(name) + " is shorter than 0.1 mm" : std::string();
}

std::string blade_flaw(const ToolGeometry& g) {
  if (std::string flaw = corners_flaw(g); !flaw.empty()) return flaw;
  const Vec3 shaft = (g.b_tool_m - g.a_tool_m).normalized(), edge = (g.c_tool_m - g.a_tool_m).normalized();
  if (shaft.cross(edge).norm() >= 1e-3) return {};
  return "the sharp edge AC lies along the shaft AB, so the blade has no direction";
}

InstrumentKind scalpel() {
  InstrumentKind s;
  s.name = "scalpel";
  s.shape = scalpel_shape;
  s.decide = scalpel_decide;
  s.flaw = blade_flaw;
  s.presses_with_tip = true;
  s.tip_pierces = true;
  return s;
}

}  // namespace sectio
