// Finds the components that a change has separated from a surface. Breadth-first searches start from all triangles that
// the change touched, and take a triangle each in turn, until all but one have met another search or have run out of
// triangles. A search that ran out has seen a whole component.
//
// Cost, by case:
//   the changed triangles hang together among themselves (every cut but one that closes): O(changed), whatever the
//   mesh's size
//   a component has come off: O(changed + (parts + 1) x the largest part that is not the rest)
//   the changed triangles hang together only over the rest of the mesh: the triangles within half the way around, that
//   is O(d^2) for a way of d triangles, until the searches meet
// A better bound needs a forest over all triangles (Holm, de Lichtenberg, Thorup 2001: O(log^2 n) for each triangle
// that changes), which costs more on every cut than these searches on the few cuts that close.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

struct Part {
  std::vector<TriangleId> triangles;  // ascending
  std::vector<VertexId> vertices;     // ascending
};

struct PartSearch {
  std::vector<Part> parts;    // the changed components but one: the rest, which is never seen whole
  TriangleId rest = kNone;    // a triangle of the rest; kNone when no changed triangle is alive
  std::uint64_t visited = 0;  // triangles looked at
};

// The same search over any graph, given by its neighbours: `seeds` ascend, each once.
struct Separated {
  std::vector<std::vector<std::uint32_t>> parts;
  std::uint32_t rest = kNone;
  std::uint64_t visited = 0;
};
using Neighbours = std::function<void(std::uint32_t of, std::vector<std::uint32_t>& neighbours)>;  // appends
Separated separated(std::span<const std::uint32_t> seeds, const Neighbours& neighbours);

// `changed`: triangle slots of a delta that has been applied, in any order; dead ones are skipped.
PartSearch separated_parts(const TriangleMesh& mesh, std::span<const TriangleId> changed);

// The whole component of a triangle. O(part).
Part part_at(const TriangleMesh& mesh, TriangleId triangle);

}  // namespace sectio
