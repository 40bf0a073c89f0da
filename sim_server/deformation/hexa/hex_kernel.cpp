#include "sim_server/deformation/hexa/hex_kernel.h"

#include <immintrin.h>

#include <algorithm>
#include <cmath>

#include "common/core/error.h"
#include "sim_server/deformation/hexa/hex_loop.h"
#include "sim_server/deformation/spring_loop.h"

namespace sectio {

namespace {

// A cell on its own attains the sum in s_e, one among others stays well below it. This share of it leaves bodies the
// step of whole cells, and a fragment within the drivers' safety.
constexpr double kShared = 0.7;

// h^2 |g|^2 at each corner of a cell, at the centroid of its material; 3/16 where that is the middle.
std::array<double, 8> steepness(const HexCell& cell) {
  std::array<double, 8> g2{};
  for (std::size_t c = 0; c < 8; ++c) {
    Vec3 w;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      w[i] = (c >> k & 1) != 0 ? 1 + cell.offset[i] : 1 - cell.offset[i];
    }
    const double x = w.x() * w.x(), y = w.y() * w.y(), z = w.z() * w.z();
    g2[c] = (y * z + z * x + x * y) / 16;
  }
  return g2;
}

double stiffest_of(const HexLattice& lattice) {
  double stiffest = 0;
  for (const HexCell& cell : lattice.cells) stiffest = std::max(stiffest, cell.stiffness);
  return stiffest > 0 ? stiffest : 1;  // all is fixed
}

// G_n, in units of V / h^2.
std::vector<double> stiffness_at_nodes(const HexLattice& lattice) {
  std::vector<double> g(lattice.nodes.size(), 0);
  for (const HexCell& cell : lattice.cells) {
    const std::array<double, 8> g2 = steepness(cell);
    for (std::size_t c = 0; c < 8; ++c) g[cell.nodes[c]] += cell.stiffness * cell.fill * g2[c];
  }
  return g;
}

double sum_over_corners(const HexCell& cell, std::span<const double> g, std::span<const double> m) {
  if (cell.fill == 0) return 0;
  double sum = 0;
  for (const std::uint32_t n : cell.nodes) sum += g[n] / m[n];
  return kShared / 12 * sum;
}

}  // namespace

std::vector<double> effective_masses(const HexLattice& lattice) {
  std::vector<double> m(lattice.nodes.size(), 0);
  for (const HexCell& cell : lattice.cells)
    for (const std::uint32_t n : cell.nodes) m[n] += cell.fill / 8;
  const std::vector<double> g = stiffness_at_nodes(lattice);
  const double stiffest = stiffest_of(lattice);
  for (const HexCell& cell : lattice.cells) {
    if (sum_over_corners(cell, g, m) <= stiffest) continue;
    for (const std::uint32_t n : cell.nodes) m[n] = std::max(m[n], g[n] * kShared / (1.5 * stiffest));
  }
  return m;
}

HexRows rows_of(const HexLattice& lattice, const HexMaterial& material) {
  HexRows rows;
  const double h = lattice.grid.cell_m;
  rows.cell_m = static_cast<float>(h);
  rows.bulk_over_shear = static_cast<float>(material.bulk_pa / material.shear_pa);
  rows.omega2_per_shear = static_cast<float>(4 * material.shear_pa / (material.density_kg_per_m3 * h * h));
  rows.stiffest = stiffest_of(lattice);
  const std::vector<double> g = stiffness_at_nodes(lattice), m = effective_masses(lattice);
  std::vector<const HexCell*> cells;  // their tissue can move
  for (const HexCell& cell : lattice.cells)
    if (cell.fill > 0) cells.push_back(&cell);
  rows.batches.resize((cells.size() + kLanes - 1) / kLanes);
  for (std::size_t b = 0; b < rows.batches.size(); ++b) {
    HexBatch& batch = rows.batches[b];
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const bool used = kLanes * b + lane < cells.size();
      const HexCell& cell = *cells[kLanes * b + (used ? lane : 0)];
      for (std::size_t c = 0; c < 8; ++c) batch.offset[c][lane] = byte_offset(cell.nodes[c]);
      if (!used) continue;
      const double weight = cell.fill * cell.stiffness;
      batch.shear[lane] = static_cast<float>(weight * material.shear_pa * h / 16);
      batch.bulk[lane] = static_cast<float>(weight * material.bulk_pa / 64);
      batch.stiffness[lane] = static_cast<float>(std::max(cell.stiffness, sum_over_corners(cell, g, m)));
      for (std::size_t k = 0; k < 3; ++k) {
        batch.offset_of_material[k][lane] = static_cast<float>(cell.offset[static_cast<Eigen::Index>(k)]);
        batch.spread[k][lane] = static_cast<float>(cell.spread[static_cast<Eigen::Index>(k)]);
      }
    }
  }
  return rows;
}

float add_forces(const HexRows& rows, bool with_bound, std::span<const Vec4f> position_world_m,
                 std::span<Vec4f> force_n, SimdWidth width) {
  HexLoopInput in;
  in.batches = rows.batches.data();
  in.batch_count = rows.batches.size();
  in.position = reinterpret_cast<const char*>(position_world_m.data());
  in.force = reinterpret_cast<char*>(force_n.data());
  in.cell_m = rows.cell_m;
  in.bulk_over_shear = rows.bulk_over_shear;
  in.with_bound = with_bound;
  return rows.omega2_per_shear * (has_sixteen_lanes(width) ? hex_forces_avx512(in) : hex_forces_avx2(in));
}

VelocityOutcome move_nodes(const VelocityUpdate& update, float step_s, float slight_kg,
                           std::span<const float> inverse_mass_per_kg, std::span<Vec4f> force_n,
                           std::span<Vec4f> velocity_m_per_s, std::span<Vec4f> position_world_m) {
  VelocityOutcome outcome;
  const float cap = update.max_speed_m_per_s;
  const __m128 h = _mm_set1_ps(step_s), damping = _mm_set1_ps(update.damping_factor), zero = _mm_setzero_ps();
  const Vec3f& g = update.gravity_step;
  const __m128 gravity = _mm_setr_ps(g.x(), g.y(), g.z(), 0);
  const __m128 each = _mm_set1_ps(0.57f * cap);  // if every component is below it, the speed is below the cap
  const __m128 no_sign = _mm_castsi128_ps(_mm_set1_epi32(0x7fffffff));
  for (std::size_t n = 0; n < force_n.size(); ++n) {
    float* const v = velocity_m_per_s[n].data();
    const float inverse = inverse_mass_per_kg[n];
    const __m128 pushed = _mm_fmadd_ps(_mm_mul_ps(h, _mm_set1_ps(inverse)), _mm_load_ps(force_n[n].data()),
                                       _mm_fmadd_ps(damping, _mm_load_ps(v), gravity));
    const __m128 now = _mm_and_ps(pushed, _mm_cmpgt_ps(_mm_set1_ps(inverse), zero));
    _mm_store_ps(v, now);
    _mm_store_ps(force_n[n].data(), zero);
    if (_mm_movemask_ps(_mm_cmp_ps(_mm_and_ps(now, no_sign), each, _CMP_NLE_UQ)) != 0) [[unlikely]] {
      const double speed = velocity_m_per_s[n].head<3>().cast<double>().norm();
      if (!std::isfinite(speed)) {
        velocity_m_per_s[n].setZero();
        if (outcome.not_finite == kNone) outcome.not_finite = static_cast<VertexId>(n);
      } else if (speed > double{cap}) {
        velocity_m_per_s[n] *= static_cast<float>(double{cap} / speed);
        outcome.clamped += slight_kg * inverse < 1;
      }
    }
    float* const x = position_world_m[n].data();
    _mm_store_ps(x, _mm_fmadd_ps(h, _mm_load_ps(v), _mm_load_ps(x)));
  }
  return outcome;
}

double omega2_at_rest(const HexMaterial& m, double cell_m, double largest_factor) {
  const double lambda = m.bulk_pa - m.shear_pa;
  return largest_factor * 12 * (lambda + 2 * m.shear_pa / 3) / (m.density_kg_per_m3 * cell_m * cell_m);
}

}  // namespace sectio
