// A change of a body's topology, before it is made (Change) and after (AppliedChange).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/delta/topology_delta.h"
#include "sim_server/engine/engine.h"
#include "sim_server/surface/cutting/cut_plan.h"
#include "sim_server/surface/indentation/contact_templates.h"

namespace sectio {

enum class Cause : std::uint8_t {
  cut,        // an instrument cut, or its stroke went on without one
  tidied,     // slivers and short edges that cuts had left were mended
  indented,   // temporary elements under instruments came, moved or went
  part_left,  // a part came off and is a body of its own, or was removed
};

struct Change {
  Cause cause = Cause::cut;
  TopologyDelta delta = {};                                  // empty: only the state of some vertices changes
  std::vector<std::pair<VertexId, VertexState>> seeds = {};  // vertices are placed so once the delta is applied
  std::shared_ptr<const CutTicket> ticket = nullptr;         // the cutting engine's plan has one
  const CutPlan* plan = nullptr;                             // for a cut: its strokes and islands
  std::optional<TemporaryContact> contact = {};              // for an indentation: the temporary elements after it
};

// A plan that leaves the topology as it is places no vertices, either.
inline Change cut_as_planned(const CutPlan& plan) {
  if (plan.delta.empty()) return {.ticket = plan.ticket, .plan = &plan};
  return {.delta = plan.delta, .seeds = plan.seeds, .ticket = plan.ticket, .plan = &plan};
}

// The effect of a change, with its delta; see TopologyChange for the lists.
struct AppliedChange {
  std::vector<VertexId> vertices;
  std::vector<TriangleId> triangles;
  std::vector<VertexId> placed;

  TopologyChange of(const TopologyDelta& delta) const { return {delta, vertices, triangles, placed}; }
};

}  // namespace sectio
