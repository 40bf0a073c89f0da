#include "sim_server/instruments/forceps.h"

#include "sim_server/instruments/probe.h"
#include "sim_server/instruments/scissors.h"

namespace sectio {
namespace {

InstrumentShape forceps_shape(const ToolGeometry& g, const InstrumentState& state) {
  InstrumentShape s = scissors_shape(g, state);
  s.edge_tip_tool_m = s.edge_heel_tool_m = s.a_tool_m;
  s.sharp_side_tool.reset();
  return s;
}

}  // namespace

InstrumentKind forceps() {
  InstrumentKind f;
  f.name = "forceps";
  f.geometry = {Vec3::Zero(), Vec3(0, 0, 0.12), Vec3(0, 0, 0.05), Vec3(0.002, 0, 0)};
  f.shape = forceps_shape;
  f.decide = probe_decide;
  f.flaw = scissors_flaw;
  f.grip_below_rad = 0.1;
  f.grip_force_n = 2;
  f.grip_radius_m = 0.004;
  return f;
}

}  // namespace sectio
