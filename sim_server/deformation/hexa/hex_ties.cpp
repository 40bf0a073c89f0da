#include "sim_server/deformation/hexa/hex_ties.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace sectio {
namespace {

constexpr double kLeastHeldArea = 1e-9;  // in faces of a cell

// sum_b K_ab w_b by corner, for vectors of either precision.
template <class Vector, class Displacement>
std::array<Vector, 8> pull(const HexTie& tie, const Displacement& displacement) {
  std::array<Vector, 8> w, sum;
  for (std::size_t b = 0; b < 8; ++b) w[b] = displacement(b);
  for (std::size_t a = 0; a < 8; ++a) {
    sum[a].setZero();
    for (std::size_t b = 0; b < 8; ++b) sum[a] += tie.k_n_per_m[a][b] * w[b];
  }
  return sum;
}

Vec3 stretch(const HexTie& tie, std::size_t corner, std::span<const Vec3> x) {
  const Vec3 from = tie.is_clamp() ? Vec3(tie.home_world_m[corner].head<3>().cast<double>()) : x[tie.to[corner]];
  return x[tie.nodes[corner]] - from;
}

}  // namespace

void HexTie::add(const Vec3& local, double k) {
  const HexPoint point{0, local};
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t b = 0; b < 8; ++b) k_n_per_m[a][b] += static_cast<float>(k * point.weight(a) * point.weight(b));
}

HexTies::HexTies(std::vector<HexTie> ties, const HexLattice& lattice)
    : ties_(std::move(ties)), first_(lattice.nodes.size() + 1, 0) {
  const auto for_ends = [&](const auto& visit) {
    for (std::uint32_t t = 0; t < ties_.size(); ++t)
      for (std::uint32_t c = 0; c < 8; ++c) {
        visit(ties_[t].nodes[c], End{t, c, false});
        if (!ties_[t].is_clamp()) visit(ties_[t].to[c], End{t, c, true});
      }
  };
  for_ends([&](std::uint32_t node, const End&) { ++first_[node + 1]; });
  for (std::size_t n = 1; n < first_.size(); ++n) first_[n] += first_[n - 1];
  ends_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for_ends([&](std::uint32_t node, const End& end) { ends_[next[node]++] = end; });
}

void HexTies::set_homes(const HexLattice& lattice, const Pose& rest_world) {
  for (HexTie& tie : ties_)
    for (std::size_t c = 0; c < 8; ++c)
      tie.home_world_m[c] << rest_world.to_world(lattice.rest_m(tie.nodes[c])).cast<float>(), 0;
}

std::vector<double> HexTies::row_sums_n_per_m(std::size_t nodes) const {
  std::vector<double> sums(nodes, 0);
  for (const HexTie& tie : ties_)
    for (std::size_t a = 0; a < 8; ++a) {
      double row = 0;
      for (const float k : tie.k_n_per_m[a]) row += std::abs(double{k});
      sums[tie.nodes[a]] += tie.is_clamp() ? row : 2 * row;
      if (!tie.is_clamp()) sums[tie.to[a]] += 2 * row;
    }
  return sums;
}

void HexTies::add_forces(std::span<const Vec4f> x, std::span<Vec4f> force_n) const {
  for (const HexTie& tie : ties_) {
    const auto f = pull<Vec4f>(tie, [&](std::size_t b) -> Vec4f {
      return x[tie.nodes[b]] - (tie.is_clamp() ? tie.home_world_m[b] : x[tie.to[b]]);
    });
    for (std::size_t a = 0; a < 8; ++a) {
      force_n[tie.nodes[a]] -= f[a];
      if (!tie.is_clamp()) force_n[tie.to[a]] += f[a];
    }
  }
}

double HexTies::energy_j(std::span<const Vec3> x) const {
  double energy = 0;
  for (const HexTie& tie : ties_) {
    const auto f = pull<Vec3>(tie, [&](std::size_t b) { return stretch(tie, b, x); });
    for (std::size_t a = 0; a < 8; ++a) energy += 0.5 * f[a].dot(stretch(tie, a, x));
  }
  return energy;
}

void HexTies::add_forces(std::span<const Vec3> x, std::span<Vec3> force_n) const {
  for (const HexTie& tie : ties_) {
    const auto f = pull<Vec3>(tie, [&](std::size_t b) { return stretch(tie, b, x); });
    for (std::size_t a = 0; a < 8; ++a) {
      force_n[tie.nodes[a]] -= f[a];
      if (!tie.is_clamp()) force_n[tie.to[a]] += f[a];
    }
  }
}

void HexTies::add_product(std::span<const Vec4f> p, std::span<Vec4f> force_n) const {
  for (const HexTie& tie : ties_) {
    const auto f = pull<Vec3f>(tie, [&](std::size_t b) -> Vec3f {
      const Vec3f own = p[tie.nodes[b]].head<3>();
      return tie.is_clamp() ? own : Vec3f(own - p[tie.to[b]].head<3>());
    });
    for (std::size_t a = 0; a < 8; ++a) {
      force_n[tie.nodes[a]].head<3>() += f[a];
      if (!tie.is_clamp()) force_n[tie.to[a]].head<3>() -= f[a];
    }
  }
}

Vec3 HexTies::force_n(std::uint32_t node, std::span<const Vec3> x) const {
  Vec3 force = Vec3::Zero();
  for (std::size_t i = first_[node]; i < first_[node + 1]; ++i) {
    const auto [t, corner, is_to] = ends_[i];
    for (std::size_t b = 0; b < 8; ++b)
      force += (is_to ? 1 : -1) * double{ties_[t].k_n_per_m[corner][b]} * stretch(ties_[t], b, x);
  }
  return force;
}

double HexTies::stiffness_n_per_m(std::uint32_t node) const {
  double k = 0;
  for (std::size_t i = first_[node]; i < first_[node + 1]; ++i)
    k += double{ties_[ends_[i].tie].k_n_per_m[ends_[i].corner][ends_[i].corner]};
  return k;
}

std::vector<HexTie> clamps_of(const HexLattice& lattice, double young_pa, std::vector<std::uint8_t>& held) {
  std::map<std::uint32_t, HexTie> clamps;                                        // by cell
  std::vector<std::array<double, 3>> fixed(lattice.nodes.size()), free = fixed;  // area by node and axis, in faces
  const double h = lattice.grid.cell_m;
  for (const HexSkin& part : lattice.skin) {
    const HexCell& cell = lattice.cells[part.cell];
    const auto& [a, b, c] = part.corners;
    const double area = 0.5 * (b - a).cross(c - a).norm();
    if (part.axis < 3) {
      const auto level = static_cast<int>(std::round(a[part.axis]));
      for (const std::uint32_t n : cell.nodes)
        if (lattice.nodes[n][part.axis] == level) (part.fixed ? fixed : free)[n][part.axis] += area;
      continue;
    }
    HexTie& tie = clamps[part.cell];
    tie.nodes = cell.nodes;
    tie.to.fill(kNone);
    const Vec3 place(cell.place[0], cell.place[1], cell.place[2]);
    // The middles of the sides are a rule of degree two.
    for (const Vec3& middle : {Vec3((a + b) / 2), Vec3((b + c) / 2), Vec3((c + a) / 2)})
      tie.add(middle - place, kClamp * young_pa * cell.stiffness / h * area * h * h / 3);
  }
  for (std::uint32_t n = 0; n < held.size(); ++n)
    for (std::size_t k = 0; k < 3; ++k)
      if (fixed[n][k] > kLeastHeldArea && fixed[n][k] > free[n][k] - kLeastHeldArea) held[n] = 1;
  std::vector<HexTie> ties;
  for (const auto& [cell, tie] : clamps)
    if (!std::ranges::all_of(tie.nodes, [&](std::uint32_t n) { return held[n] != 0; })) ties.push_back(tie);
  return ties;
}

}  // namespace sectio
