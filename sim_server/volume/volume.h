// A volume of tetrahedra behind the surface of a body: what the engines of the volume share.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "sim_server/deformation/tetra/vertex_set.h"
#include "sim_server/deformation/tetra/volume_deformation.h"
#include "sim_server/engine/engine.h"
#include "sim_server/volume/surface_map.h"
#include "sim_server/volume/tets/tet_topology.h"

namespace sectio {

// A component that comes off a volume: the vertex of each slot of its surface, and by vertex its number in the volume.
struct VolumePart {
  TetMesh mesh;
  std::vector<VertexId> vertex_of, vertex_from;
};

struct Volume {
  using IsFixed = std::function<bool(const Vec3& rest_body_m)>;

  // `vertex_of` each slot of the surface. `deformation` moves the mesh, and outlives the last use of this.
  Volume(const TetMesh& mesh, std::vector<VertexId> vertex_of, VolumeDeformation& deformation, IsFixed is_fixed);

  bool is_fixed_at(const Vec3& rest_body_m) const { return is_fixed && is_fixed(rest_body_m); }
  TetVertexState state_of(const SharedBody& body, VertexId v) const;

  // The tetrahedra of the component whose surface has these slots, all of them. O(component).
  std::vector<std::uint32_t> tetrahedra_of(std::span<const VertexId> slots) const;
  // The component of these slots. O(component).
  VolumePart part(std::span<const VertexId> slots) const;

  // Masses go by volume, so a change of the topology moves mass between vertices. These keep the momentum.
  struct Momentum {
    std::vector<VertexId> vertices;  // ascending; empty: nothing is to be kept
    Vec3 sum_n_s = Vec3::Zero();
  };
  // The momentum of the corners of these edits, or of these vertices.
  Momentum momentum(const SharedBody& body, std::span<const TetEdit> edits) const;
  Momentum momentum(const SharedBody& body, std::vector<VertexId> ascending) const;
  // The free ones of the vertices share what has gone missing since, each getting the same velocity.
  void conserve_momentum(const SharedBody& body, const Momentum& before);

  template <class A>
  void archive(A& a) {
    a(topology, surface, mean_edge_m);
    if (a.reads()) visited.begin(topology.vertex_count());
  }

  VolumeDeformation& deformation;
  IsFixed is_fixed;  // empty: nothing is
  TetTopology topology;
  SurfaceMap surface;
  double mean_edge_m;
  mutable VertexSet visited;  // scratch
};

}  // namespace sectio
