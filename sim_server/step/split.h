// A body that has fallen into parts becomes bodies: anchored parts and parts that may deform go on deforming, free ones
// move rigidly, crumbs are removed.
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "sim_server/world/body.h"

namespace sectio {

struct Split {
  std::vector<TopologyDelta> deltas;               // of the body that was split, in the order applied
  std::vector<std::unique_ptr<Body>> parts;        // new bodies, numbered from `next_id` on
  std::vector<std::vector<VertexId>> vertex_from;  // of each part, by vertex: its slot in the body
  std::vector<double> removed_m3;                  // volumes of fragments, at rest
};

// Looks at what changed since the last call, unless a stroke still works on it. The component with fixed vertices stays
// the body; of several the largest, and where none is fixed the one that is largest of all. `specs` keeps the parts'
// specifications for as long as they live. At most `room` new bodies: what comes off beyond stays in the body.
Split split_body(Body& body, const Scene& scene, std::uint32_t next_id, std::uint32_t room,
                 std::deque<BodySpec>& specs);

}  // namespace sectio
