#include "sim_server/deformation/hexa/hex_descent.h"

#include <Eigen/LU>
#include <cmath>
#include <utility>

namespace sectio {

HexDescent::HexDescent(const HexLattice& lattice, const HexMaterial& material, HexTies ties)
    : lattice_(&lattice), ties_(std::move(ties)), first_(lattice.nodes.size() + 1, 0) {
  for (const HexCell& cell : lattice.cells) {
    cells_.emplace_back(cell, material, lattice.grid.cell_m);
    for (const std::uint32_t n : cell.nodes) ++first_[n + 1];
  }
  for (std::size_t n = 1; n < first_.size(); ++n) first_[n] += first_[n - 1];
  corners_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t e = 0; e < lattice.cells.size(); ++e)
    for (std::uint32_t c = 0; c < 8; ++c) corners_[next[lattice.cells[e].nodes[c]]++] = {e, c};
}

double HexDescent::elastic_energy_j(std::span<const Vec3> x) const {
  double energy = ties_.energy_j(x);
  for (std::size_t e = 0; e < cells_.size(); ++e) energy += cells_[e].value_j(modes_of(lattice_->cells[e], x));
  return energy;
}

void HexDescent::add_forces(std::span<const Vec3> x, std::span<Vec3> force_n) {
  for (std::size_t e = 0; e < cells_.size(); ++e) {
    const HexCell& cell = lattice_->cells[e];
    HexModes f = cells_[e].slope_n(modes_of(cell, x));
    from_modes(f);
    for (std::size_t c = 0; c < 8; ++c) force_n[cell.nodes[c]] -= f[c];
  }
  ties_.add_forces(x, force_n);
}

void HexDescent::linearise(std::span<const Vec3> x) {
  at_.assign(x.begin(), x.end());
}

void HexDescent::add_product(std::span<Vec4f> p_m, std::span<Vec4f> force_n) const {
  for (std::size_t e = 0; e < cells_.size(); ++e) {
    const HexCell& cell = lattice_->cells[e];
    HexModes p;
    for (std::size_t c = 0; c < 8; ++c) p[c] = p_m[cell.nodes[c]].head<3>().cast<double>();
    to_modes(p);
    HexModes f = cells_[e].product(modes_of(cell, at_), p);
    from_modes(f);
    for (std::size_t c = 0; c < 8; ++c) force_n[cell.nodes[c]].head<3>() += f[c].cast<float>();
  }
  ties_.add_product(p_m, force_n);
}

void HexDescent::add_blocks(std::span<Mat3> blocks) const {
  for (std::uint32_t n = 0; n < blocks.size(); ++n) blocks[n] += block(n, at_).stiffness_n_per_m;
}

HexEnergy::Block HexDescent::block(std::uint32_t node, std::span<const Vec3> x) const {
  HexEnergy::Block block;
  for (std::size_t i = first_[node]; i < first_[node + 1]; ++i) {
    const auto [e, corner] = corners_[i];
    const HexEnergy::Block own = cells_[e].block(modes_of(lattice_->cells[e], x), corner);
    block.force_n += own.force_n;
    block.stiffness_n_per_m += own.stiffness_n_per_m;
  }
  if (ties_.empty()) return block;
  block.force_n += ties_.force_n(node, x);
  block.stiffness_n_per_m.diagonal().array() += ties_.stiffness_n_per_m(node);
  return block;
}

double HexDescent::sweep(double step_s, std::span<const double> mass_kg, std::span<const Vec3> inertial_world_m,
                         std::span<Vec3> x) const {
  double furthest = 0;
  for (std::uint32_t n = 0; n < x.size(); ++n) {
    if (!(mass_kg[n] > 0)) continue;
    const double inertia = mass_kg[n] / (step_s * step_s);
    HexEnergy::Block own = block(n, x);
    own.force_n += inertia * (inertial_world_m[n] - x[n]);
    own.stiffness_n_per_m.diagonal().array() += inertia;
    const Vec3 move = own.stiffness_n_per_m.inverse() * own.force_n;
    x[n] += move;
    furthest = std::max(furthest, move.norm());
  }
  return furthest;
}

}  // namespace sectio
