// What both models know of a volume besides its stiffness: the shape at rest, who is at which vertex, and masses by
// volume, rho V / 4 from each tetrahedron; and how all of this follows a change, in time that only the change counts
// for.
#pragma once

#include "sim_server/deformation/tetra/tet_star.h"
#include "sim_server/deformation/tetra/vertex_set.h"
#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio {

class TetBody {
 public:
  TetBody(const TetMesh& mesh, const VolumeMaterial& material, std::span<const std::uint8_t> fixed);

  const TetMesh& mesh() const { return mesh_; }  // numbers that are not used any more included
  const TetStars& stars() const { return stars_; }
  std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(mass_.size()); }
  double stiffness_factor(std::uint32_t t) const { return stiffness_factor_.empty() ? 1 : stiffness_factor_[t]; }
  double volume_m3(std::uint32_t t) const { return volume_m3_[t]; }
  bool fixed(VertexId v) const { return fixed_[v] != 0; }
  double mass_kg(VertexId v) const { return mass_[v]; }
  double total_kg() const { return total_kg_; }
  double added_mass_fraction() const { return total_kg_ > 0 ? added_kg_ / total_kg_ : 0; }
  // Of the effective mass; 0 where it is fixed.
  std::span<const double> inverse_mass() const { return inverse_mass_; }

  // The vertices whose tetrahedra, or their places at rest, are not what they were, ascending; they have their own mass
  // again and no other. Those without any tetrahedron are gone. Valid until the next change.
  std::span<const VertexId> follow(const TetChange& change);
  // As heavy as that at least, for the sake of stability; its own mass when that is enough.
  void weigh_at_least(VertexId v, double mass_kg);

 private:
  void weigh(VertexId v);
  void follow_stiffness(const TetChange& change);

  TetMesh mesh_;
  TetStars stars_;
  double density_kg_per_m3_;
  std::vector<double> stiffness_factor_;  // of each tetrahedron; empty: 1
  std::vector<double> volume_m3_;         // of each tetrahedron
  std::vector<std::uint8_t> fixed_;
  std::vector<double> mass_, added_, inverse_mass_;
  double total_kg_ = 0, added_kg_ = 0;
  VertexSet touched_;
};

}  // namespace sectio
