#include "sim_server/instruments/cautery_hook.h"

#include "sim_server/instruments/scalpel.h"

namespace sectio {
namespace {

InstrumentShape cautery_hook_shape(const ToolGeometry& g, const InstrumentState& state) {
  const Vec3 d = g.c_tool_m + state.intensity * (g.d_tool_m - g.c_tool_m);
  // The probe burns what it is in, too: tissue above its end, when that is beneath the surface.
  const Vec3 heel = state.intensity > 0 ? g.a_tool_m : g.c_tool_m;
  return {g.a_tool_m, g.b_tool_m, g.c_tool_m, d, d, heel, std::nullopt};
}

CutDecision cautery_hook_decide(const Situation&) {
  return CutDecision::cut;
}

}  // namespace

InstrumentKind cautery_hook() {
  InstrumentKind hook;
  hook.name = "cautery_hook";
  // The probe AC hangs from the shaft with its end C in the origin; the virtual tip CD continues it.
  hook.geometry = {Vec3(0, 0, 0.008), Vec3(0, 0, 0.04), Vec3::Zero(), Vec3(0, 0, -0.005)};
  hook.shape = cautery_hook_shape;
  hook.decide = cautery_hook_decide;
  hook.flaw = corners_flaw;
  hook.edge_enters = true;
  hook.front_is_virtual = true;
  hook.drag = 0.05;  // tissue that is burnt hardly resists
  return hook;
}

}  // namespace sectio
