#include "sim_server/deformation/hexa/hex_descent.h"

#include <Eigen/LU>
#include <bit>
#include <cmath>

namespace sectio {
namespace {

using Modes = std::array<Vec3, 8>;

constexpr auto kSigns = [] {
  std::array<std::array<double, 8>, 8> signs{};
  for (unsigned corner = 0; corner < 8; ++corner)
    for (unsigned mode = 0; mode < 8; ++mode) signs[corner][mode] = std::popcount(~corner & mode) % 2 == 0 ? 1 : -1;
  return signs;
}();

Modes modes_of(const HexCell& cell, std::span<const Vec3> x) {
  Modes m;
  for (std::size_t c = 0; c < 8; ++c) m[c] = x[cell.nodes[c]];
  for (std::size_t step = 1; step < 8; step *= 2)
    for (std::size_t c = 0; c < 8; ++c) {
      if ((c & step) != 0) continue;
      const Vec3 sum = m[c] + m[c | step];
      m[c | step] -= m[c];
      m[c] = sum;
    }
  return m;
}

// The factors of the kernel's modes.
struct Weights {
  double a, b, h;  // phi mu h / 16, phi kappa / 64

  Weights(const HexCell& cell, const HexMaterial& material, double cell_m)
      : a(cell.fill * cell.stiffness * material.shear_pa * cell_m / 16),
        b(cell.fill * cell.stiffness * material.bulk_pa / 64),
        h(cell_m) {}
  double swelling(const Modes& m) const { return m[1].dot(m[2].cross(m[4])) / (64 * h * h * h) - 1; }
};

}  // namespace

HexDescent::HexDescent(const HexLattice& lattice, const HexMaterial& material)
    : lattice_(&lattice), material_(material), first_(lattice.nodes.size() + 1, 0) {
  for (const HexCell& cell : lattice.cells)
    for (const std::uint32_t n : cell.nodes) ++first_[n + 1];
  for (std::size_t n = 1; n < first_.size(); ++n) first_[n] += first_[n - 1];
  corners_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t e = 0; e < lattice.cells.size(); ++e)
    for (std::uint32_t c = 0; c < 8; ++c) corners_[next[lattice.cells[e].nodes[c]]++] = {e, c};
}

// The energy in terms of modes: phi V mu / 2 |F|^2 = a/2 |M|^2 and so on.
double HexDescent::elastic_energy_j(std::span<const Vec3> position_world_m) const {
  double energy = 0;
  for (const HexCell& cell : lattice_->cells) {
    const Weights w(cell, material_, lattice_->grid.cell_m);
    const Modes m = modes_of(cell, position_world_m);
    const double j1 = w.swelling(m), h = w.h;
    energy += 0.5 * w.a * (m[1].squaredNorm() + m[2].squaredNorm() + m[4].squaredNorm() - 48 * h * h);
    energy += 64 * h * h * h * (0.5 * w.b * j1 * j1 - w.a / (4 * h) * j1);
    energy += kHourglass * w.a * (m[3].squaredNorm() + m[5].squaredNorm() + m[6].squaredNorm());
    energy += 0.5 * kHourglass * w.a * m[7].squaredNorm();
  }
  return energy;
}

HexDescent::Block HexDescent::block(std::uint32_t node, std::span<const Vec3> x) const {
  Block block;
  for (std::size_t i = first_[node]; i < first_[node + 1]; ++i) {
    const auto [e, c] = corners_[i];
    const HexCell& cell = lattice_->cells[e];
    const Weights w(cell, material_, lattice_->grid.cell_m);
    const Modes m = modes_of(cell, x);
    const std::array<double, 8>& s = kSigns[c];
    // 64 h^3 dJ / dx
    const Vec3 growth = s[1] * m[2].cross(m[4]) + s[2] * m[4].cross(m[1]) + s[4] * m[1].cross(m[2]);
    block.force_n -= w.a * (s[1] * m[1] + s[2] * m[2] + s[4] * m[4]);
    block.force_n -= (w.b * w.swelling(m) - w.a / (4 * w.h)) * growth;
    block.force_n -= 2 * kHourglass * w.a * (s[3] * m[3] + s[5] * m[5] + s[6] * m[6] + 0.5 * s[7] * m[7]);
    block.stiffness_n_per_m.diagonal().array() += w.a * (3 + 7 * kHourglass);
    block.stiffness_n_per_m += w.b / (64 * w.h * w.h * w.h) * growth * growth.transpose();
  }
  return block;
}

double HexDescent::sweep(double step_s, std::span<const double> mass_kg, std::span<const Vec3> inertial_world_m,
                         std::span<Vec3> x) const {
  double furthest = 0;
  for (std::uint32_t n = 0; n < x.size(); ++n) {
    if (!(mass_kg[n] > 0)) continue;
    const double inertia = mass_kg[n] / (step_s * step_s);
    Block own = block(n, x);
    own.force_n += inertia * (inertial_world_m[n] - x[n]);
    own.stiffness_n_per_m.diagonal().array() += inertia;
    const Vec3 move = own.stiffness_n_per_m.inverse() * own.force_n;
    x[n] += move;
    furthest = std::max(furthest, move.norm());
  }
  return furthest;
}

}  // namespace sectio
