// A box of triquadratic bricks (27 nodes, 27 Gauss points) of the stable neo-Hookean solid, in double precision: an
// element family that no model has, without locking to speak of, for references at rest.
#pragma once

#include <optional>

#include "tests/support/newton.h"

namespace sectio::test {

// Opened before the load: the plane x = at_x_m, above z = from_z_m; both between bricks.
struct Slit {
  double at_x_m = 0, from_z_m = 0;
};

class BrickReference final : public ElasticReference {
 public:
  BrickReference(std::array<int, 3> bricks, const Vec3& size_m, const Lame& material,
                 const std::optional<Slit>& slit = {});

  const Points& nodes_m() const { return nodes_; }

  double energy_j(const Points& x) const override;

  Points forces_n(const Points& x) const override;

  // d^2 J / dx_a dx_b = [F (g_b x g_a)]_x, with [w]_x v = w x v.
  Sparse hessian(const Points& x) const override;

  Points equilibrium(const Points& x, const std::vector<std::uint8_t>& held, const Points& load,
                     double tolerance_n) const;

  // The load of a force per volume at rest, N/m^3.
  Points body_load_n(const Vec3& per_volume) const;

  // The place of the point that is at `rest_m` at rest; on a slit, the place of the side at smaller x.
  Vec3 at(const Vec3& rest_m, const Points& x) const;

 private:
  using Brick = std::array<std::uint32_t, 27>;
  struct GaussPoint {
    double volume_m3 = 0;
    std::array<double, 27> value;
    std::array<Vec3, 27> slope;  // slopes of the shape functions, 1/m
  };

  void make_nodes(const std::optional<Slit>& slit);

  // local in [-1, 1]^3; the node a is at (a / 9, a / 3 % 3, a % 3) - 1.
  GaussPoint shape_at(const Vec3& local) const;

  void make_gauss_points();

  Mat3 gradient(const Brick& brick, const GaussPoint& q, const Points& x) const;

  std::array<int, 3> count_;
  Vec3 size_;
  double mu_, kappa_;
  Points nodes_;
  std::vector<Brick> bricks_;
  std::vector<GaussPoint> gauss_;
};

}  // namespace sectio::test
