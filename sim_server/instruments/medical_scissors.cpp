#include "sim_server/instruments/medical_scissors.h"

#include "sim_server/instruments/scissors.h"

namespace sectio {
namespace {

// The shape of one edge of each U with the opposite edge of the other blade.
InstrumentShape medical_scissors_shape(const ToolGeometry& g, const InstrumentState& state) {
  const Vec3 aside = (g.a_tool_m - g.c_tool_m).cross(g.d_tool_m - g.a_tool_m).stableNormalized();
  const Vec3 shift = (state.edge == 0 ? 0.5 : -0.5) * g.gauge_m * aside;
  InstrumentShape s = scissors_shape(g, state);
  for (Vec3* point : {&s.a_tool_m, &s.b_tool_m, &s.c_tool_m, &s.d_tool_m, &s.edge_tip_tool_m, &s.edge_heel_tool_m})
    *point += shift;
  return s;
}

std::string medical_scissors_flaw(const ToolGeometry& g) {
  if (std::string flaw = scissors_flaw(g); !flaw.empty()) return flaw;
  return g.gauge_m >= 1e-3 ? std::string() : "gauge_m must be at least 1 mm";
}

}  // namespace

InstrumentKind medical_scissors() {
  InstrumentKind s = scissors();
  s.name = "medical_scissors";
  s.geometry.gauge_m = 0.008;
  s.shape = medical_scissors_shape;
  s.flaw = medical_scissors_flaw;
  s.edges = 2;
  return s;
}

}  // namespace sectio
