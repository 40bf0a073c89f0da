#include "sim_server/instruments/knife.h"

#include "sim_server/instruments/scalpel.h"

namespace sectio {
namespace {

// The end of the sharp part.
Vec3 end_of_sharp_tool_m(const ToolGeometry& g) {
  return g.a_tool_m + g.sharp_length_m * (g.c_tool_m - g.a_tool_m).stableNormalized();
}

InstrumentShape knife_shape(const ToolGeometry& g, const InstrumentState& state) {
  InstrumentShape s = scalpel_shape(g, state);
  s.edge_heel_tool_m = end_of_sharp_tool_m(g);
  return s;
}

CutDecision knife_decide(const Situation& s) {
  if (!s.crossings.ab) return CutDecision::detect_again;
  if (s.crossings.edge) return s.correct_direction ? CutDecision::cut : CutDecision::push_back;
  if (s.crossings.ac) return CutDecision::deform_with_shaft;
  return s.crossings.bd ? CutDecision::push_out : CutDecision::deform_with_shaft;
}

std::string knife_flaw(const ToolGeometry& g) {
  if (std::string flaw = blade_flaw(g); !flaw.empty()) return flaw;
  const double edge_m = (g.c_tool_m - g.a_tool_m).norm();
  if (g.sharp_length_m >= 1e-4 && g.sharp_length_m <= edge_m) return {};
  return "sharp_length_m must be at least 0.1 mm and at most |AC|, " + std::to_string(edge_m);
}

}  // namespace

InstrumentKind knife() {
  InstrumentKind k;
  k.name = "knife";
  k.geometry = {Vec3::Zero(), Vec3(0, 0, 0.05), Vec3(0.010, 0, 0.030), Vec3(0.010, 0, 0.05), 0.012, 0};
  k.shape = knife_shape;
  k.decide = knife_decide;
  k.flaw = knife_flaw;
  k.presses_with_tip = true;
  k.tip_pierces = true;
  return k;
}

}  // namespace sectio
