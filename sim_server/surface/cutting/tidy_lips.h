// Slivers that cuts have left beside lips and in walls are mended once no blade is at the body: an edge is flipped, or
// a vertex of the skin or a rung of a groove goes. A rung goes only where the curve of the cut stays within a fifth of
// a millimetre; both lips keep the same places at rest, and no vertex moves. All mends of a body together change its
// volume by a share of 4e-5 at most.
#pragma once

#include <cstdint>

#include "sim_server/surface/cutting/grooves.h"

namespace sectio {

// How far the search has come. It goes round through all rungs until a round changes nothing.
struct LipSearch {
  VertexId next = kNone;           // the lip to look at next; kNone: there is nothing to find
  bool has_changed = false;        // the mesh has, in this round
  double edge_m = 0, body_m3 = 0;  // mean edge and volume of the mesh when the first round began
  double change_m3 = 0;            // all mends so far have changed its volume by so much

  template <class A>
  void archive(A& a) {
    a(next, has_changed, edge_m, body_m3, change_m3);
  }
};

struct TidiedLips {
  TopologyDelta delta;  // empty(): nothing was found among the rungs looked at
  Grooves grooves;
  LipSearch search;
  std::uint32_t edges_collapsed = 0;
};

// A triangle is a sliver below this angle, or thinner than this share of the mesh's mean edge.
constexpr double kSliver_deg = 7, kSliverOfEdge = 0.12;

// Looks at the next few rungs of the progressive style. Changes nothing by itself.
TidiedLips tidy_lips(const TriangleMesh& mesh, ParticleView particles, const Grooves& grooves, LipSearch search);

}  // namespace sectio
