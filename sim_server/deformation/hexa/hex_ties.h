// Springs between nodes of the lattice, spread over an area: over the part of the surface that is fixed, and over the
// tissue that is still whole where a cut ends inside a cell. With N_a the weights of a cell's corners, displacements
// w_a of the corners, and k in N/m^3,
//
//   E = k/2 integral |sum_a N_a w_a|^2 = 1/2 sum_ab K_ab w_a . w_b,   K_ab = k integral N_a N_b
//
// where w_a = x_a - X_a to the places at rest, or w_a = x_a - y_a between two copies of a cell.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/math/types.h"
#include "sim_server/deformation/hexa/hex_lattice.h"

namespace sectio {

struct HexTie {
  std::array<std::uint32_t, 8> nodes{}, to{};  // to[0] kNone: to the places at rest
  std::array<std::array<float, 8>, 8> k_n_per_m{};
  std::array<Vec4f, 8> home_world_m;

  HexTie() { home_world_m.fill(Vec4f::Zero()); }

  bool is_clamp() const { return to[0] == kNone; }
  // Adds the integral over a small area about a point of the cell, from 0 to 1 along each axis.
  void add(const Vec3& local, double k_n_per_m);
};

class HexTies {
 public:
  HexTies() = default;
  HexTies(std::vector<HexTie> ties, const HexLattice& lattice);

  bool empty() const { return ties_.empty(); }
  // Places of the nodes at rest, in the world.
  void set_homes(const HexLattice& lattice, const Pose& rest_world);
  // The sum of |K_ab| at each node: with m = that / omega^2 more mass, no frequency is above omega.
  std::vector<double> row_sums_n_per_m(std::size_t nodes) const;

  void add_forces(std::span<const Vec4f> position_world_m, std::span<Vec4f> force_n) const;
  // The same in double precision; the Hessian times p; and for one node the force and the Hessian, a multiple of 1.
  double energy_j(std::span<const Vec3> position_world_m) const;
  void add_forces(std::span<const Vec3> position_world_m, std::span<Vec3> force_n) const;
  void add_product(std::span<const Vec4f> p_m, std::span<Vec4f> force_n) const;
  Vec3 force_n(std::uint32_t node, std::span<const Vec3> position_world_m) const;
  double stiffness_n_per_m(std::uint32_t node) const;

 private:
  struct End {
    std::uint32_t tie, corner;
    bool is_to;
  };
  std::vector<HexTie> ties_;
  std::vector<std::size_t> first_;  // by node: index of its first entry in ends_
  std::vector<End> ends_;
};

// The fixed parts of the surface. Nodes in a plane of the lattice more than half of whose surface around them is
// fixed are `held`; elsewhere a cell is clamped by a stiffness of kClamp E / h a unit of area, in units of E =
// young_pa. Nothing stronger: a plane oblique to the lattice would lock it.
constexpr double kClamp = 16;
std::vector<HexTie> clamps_of(const HexLattice& lattice, double young_pa, std::vector<std::uint8_t>& held);

}  // namespace sectio
