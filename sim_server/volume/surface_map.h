// The surface of a volume of tetrahedra as the rest of a simulation sees it: slots of a mesh of triangles. A vertex of
// the volume keeps its number for good; here is which slots of the surface it has. Mostly none, inside, or one; where
// the surface touches itself in a vertex, one for each fan of triangles, so that it is a manifold there, too.
#pragma once

#include <functional>
#include <map>
#include <span>
#include <vector>

#include "sim_server/surface/cutting/mesh_draft.h"
#include "sim_server/volume/tets/boundary_change.h"

namespace sectio {

using Corners3 = std::array<VertexId, 3>;

class SurfaceMap {
 public:
  SurfaceMap(std::vector<VertexId> vertex_of, std::size_t vertices);  // `vertex_of`: by slot; `vertices`: of the volume

  // The vertex of each slot; kNone where the slot is dead.
  std::span<const VertexId> vertices() const { return vertex_of_; }
  VertexId vertex_of(VertexId slot) const { return vertex_of_[slot]; }
  std::span<const VertexId> slots_of(VertexId vertex) const;
  // The triangle with these corners of the volume, counter-clockwise from outside; kNone if there is none.
  TriangleId triangle_of(const TriangleMesh& mesh, const Corners3& corners) const;
  Corners3 in_volume(const Triangle& triangle) const {
    return {vertex_of(triangle.v[0]), vertex_of(triangle.v[1]), vertex_of(triangle.v[2])};
  }

  // Edges of the surface to be, as numbered in the volume, at which more than two triangles meet. Ascending.
  std::vector<std::array<VertexId, 2>> pinched_edges(const TriangleMesh& mesh, const BoundaryChange& change) const;

  // The slots' part of a change of the volume.
  struct Change {
    std::map<VertexId, VertexId> taken;  // slot -> vertex
    std::vector<VertexId> freed;         // slots
  };
  using StateOf = std::function<VertexState(VertexId vertex)>;
  using LabelOf = std::function<Surface(const Corners3&)>;
  // Writes the change into a surface draft. `moved`: reused vertex numbers whose rest position differs. False when what
  // is left would not be a manifold: the draft is not to be used any more. O(change).
  bool plan(const TriangleMesh& mesh, const BoundaryChange& change, std::span<const VertexId> moved,
            const StateOf& state_of, const LabelOf& label_of, MeshDraft& draft, Change& result) const;
  void accept(const Change& change);

  template <class A>
  void archive(A& a) {
    a(vertex_of_, slots_of_);
  }

 private:
  std::vector<VertexId> vertex_of_;              // by slot
  std::vector<std::vector<VertexId>> slots_of_;  // by vertex, ascending
};

}  // namespace sectio
