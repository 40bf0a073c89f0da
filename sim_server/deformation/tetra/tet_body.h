// The data that all models of a volume share: the rest shape, the tetrahedra at each vertex, and lumped masses, rho V /
// 4 from each tetrahedron. It follows a change in time proportional to the change.
#pragma once

#include "sim_server/deformation/tetra/tet_star.h"
#include "sim_server/deformation/tetra/vertex_set.h"
#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio {

class TetBody {
 public:
  TetBody(const TetMesh& mesh, const VolumeMaterial& material, std::span<const std::uint8_t> fixed);

  const TetMesh& mesh() const { return mesh_; }  // including numbers that are no longer in use
  const TetStars& stars() const { return stars_; }
  std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(mass_.size()); }
  bool has_stiffness_factors() const { return !stiffness_factor_.empty(); }
  double stiffness_factor(std::uint32_t t) const { return stiffness_factor_.empty() ? 1 : stiffness_factor_[t]; }
  double volume_m3(std::uint32_t t) const { return volume_m3_[t]; }
  bool fixed(VertexId v) const { return fixed_[v] != 0; }
  double mass_kg(VertexId v) const { return mass_[v]; }
  double total_kg() const { return total_kg_; }
  double added_mass_fraction() const { return total_kg_ > 0 ? added_kg_ / total_kg_ : 0; }
  // The inverse of the effective mass, added mass included; 0 for fixed vertices.
  std::span<const double> inverse_mass() const { return inverse_mass_; }

  // Returns the vertices whose tetrahedra, or their rest shapes, have changed, ascending. Their mass is computed anew,
  // without added mass; those without any tetrahedron no longer exist. Valid until the next change.
  std::span<const VertexId> follow(const TetChange& change);
  // Adds mass, for the sake of stability, until the vertex has at least this mass; none if its own is enough, or if the
  // body would have more than kAddedMassGiven.
  void weigh_at_least(VertexId v, double mass_kg);
  // More than kMuchAddedMass has been added, or some was refused.
  bool is_heavy() const { return refused_ || added_kg_ > kMuchAddedMass * total_kg_; }
  // Takes all added mass away. O(all).
  void shed_added_mass();
  // Calls weigh_all(substep_s), which weighs all vertices for substeps of this length, or of half of it, and so on,
  // until the body isn't heavy. Returns the length that it came to.
  template <class WeighAll>
  double weigh_for(double substep_s, const WeighAll& weigh_all) {
    weigh_all(substep_s);
    for (; is_heavy(); weigh_all(substep_s)) shed_added_mass(), substep_s /= 2;
    return substep_s;
  }

  template <class A>
  void archive(A& a) {
    a(mesh_, stars_, stiffness_factor_, volume_m3_, fixed_, mass_, added_, inverse_mass_, total_kg_, added_kg_,
      refused_);
  }

 private:
  void weigh(VertexId v);
  void follow_stiffness(const TetChange& change);

  TetMesh mesh_;
  TetStars stars_;
  double density_kg_per_m3_;
  std::vector<double> stiffness_factor_;  // one a tetrahedron; empty: 1
  std::vector<double> volume_m3_;         // one a tetrahedron
  std::vector<std::uint8_t> fixed_;
  std::vector<double> mass_, added_, inverse_mass_;
  double total_kg_ = 0, added_kg_ = 0;
  bool refused_ = false;  // some mass was refused since it was shed
  VertexSet touched_;
};

}  // namespace sectio
