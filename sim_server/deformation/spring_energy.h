// The energy of springs in rows (spring_rows.h), with their home springs, for the implicit driver. Only the
// positive part of each spring's Hessian is kept: across a spring that is shorter than at rest it is 0.
#pragma once

#include <vector>

#include "sim_server/deformation/newton_step.h"
#include "sim_server/deformation/spring_rows.h"

namespace sectio {

class SpringEnergy final : public ElasticEnergy {
 public:
  // Reads the rows anew; call before each step that this is used for. Each spring is in the rows of both its ends.
  void read(const SpringRows& rows, std::uint32_t vertex_count);

  double energy_j(std::span<const Vec3> position_world_m) override;
  void add_forces(std::span<const Vec3> position_world_m, std::span<Vec3> force_n) override;
  void linearise(std::span<const Vec3> position_world_m) override;
  void add_product(std::span<Vec4f> p_m, std::span<Vec4f> force_n) const override;
  void add_blocks(std::span<Mat3> blocks_n_per_m) const override;

 private:
  struct End {
    HalfEdge spring;
    Vec3f along = Vec3f::Zero();           // unit
    float k_across = 0, k_more_along = 0;  // N/m
  };
  struct Vertex {
    double k_home = 0;
    Vec3 home_world_m = Vec3::Zero();
  };
  std::vector<Vertex> vertices_;
  std::vector<std::uint32_t> first_;
  std::vector<End> ends_;
};

}  // namespace sectio
