// A block of 0.1 x 0.05 x 0.05 m whose ends are gripped and moved further and faster than any surgeon would (methods
// 3.1, 3.4).
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <string>

#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/shape_matching.h"

#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "tests/support/tet_shapes.h"

namespace sectio::test {

enum class Load { compress, stretch, twist, slam };
constexpr Load kLoads[] = {Load::compress, Load::stretch, Load::twist, Load::slam};
std::string name_of(Load load);

struct Outcome {
  bool finite = true;
  double furthest_m = 0;  // any vertex, from the origin
  double most_kinetic_j = 0, most_work_j = 0;
  double energy_j = 0;                         // now
  double away_m = 0;                           // now, the furthest vertex from where it is at rest up to a rigid motion
  int steps = 0, taken_over = 0, divided = 0;  // steps
  double least_margin = HUGE_VAL;              // least margin of tetrahedra, in explicit steps
  std::uint64_t clamped = 0;                   // velocities of springs
};

class Violence {
 public:
  // neo_hookean, implicit (the same, with that driver only), neo_hookean_lattice, tetra_springs.
  Violence(const std::string& model, double poisson, double step_s = 0.001, int cells = 3);

  // Within 0.1 s, a slam within 0.02 s; then held for 0.05 s. `share` of the load.
  void load(Load load, double share = 1);
  void let_go(int steps);
  // From a state of one's own, at rest.
  void put(const std::function<Vec3(VertexId, const Vec3&)>& place_m);

  Outcome outcome();
  int inverted() const;
  bool is_taken_over() const;

 private:
  Vec3 at(VertexId i) const { return x_[i].head<3>().cast<double>(); }
  int end_of(VertexId i) const;
  // Both ends move.
  Vec3 place_m(VertexId i, Load load, double share) const;
  void step(std::span<const PointConstraint> grips, std::span<Reaction> reactions);

  TetMesh mesh_;
  double step_s_;
  std::shared_ptr<VolumeModel> model_;
  std::shared_ptr<TetSolid> solid_;
  std::shared_ptr<HexSolid> lattice_;
  std::shared_ptr<TetSprings> springs_;
  Points x_, v_;
  std::vector<VertexId> ends_;
  Outcome outcome_;
  double work_j_ = 0;
};

}  // namespace sectio::test
