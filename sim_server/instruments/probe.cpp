#include "sim_server/instruments/probe.h"

#include "sim_server/instruments/scalpel.h"

namespace sectio {
namespace {

InstrumentShape probe_shape(const ToolGeometry& g, const InstrumentState&) {
  return {g.a_tool_m, g.b_tool_m, g.c_tool_m, g.d_tool_m, g.a_tool_m, g.a_tool_m, std::nullopt};
}

}  // namespace

CutDecision probe_decide(const Situation& s) {
  return s.crossings.ab ? CutDecision::deform_with_shaft : CutDecision::detect_again;
}

InstrumentKind probe() {
  InstrumentKind p;
  p.name = "probe";
  // A is the middle of the round end, CD the side of the rod.
  p.geometry = {Vec3::Zero(), Vec3(0, 0, 0.05), Vec3(0.0015, 0, 0.0015), Vec3(0.0015, 0, 0.05)};
  p.geometry.sphere_radius_m = 0.0015;
  p.shape = probe_shape;
  p.decide = probe_decide;
  p.flaw = corners_flaw;
  p.presses_with_tip = true;
  return p;
}

}  // namespace sectio
