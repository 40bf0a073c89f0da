#include "sim_server/deformation/hexa/hex_kernel.h"

#include <immintrin.h>

#include <algorithm>
#include <cmath>

#include "common/core/error.h"
#include "sim_server/deformation/hexa/hex_loop.h"
#include "sim_server/deformation/spring_loop.h"

namespace sectio {

HexRows rows_of(const HexLattice& lattice, const HexMaterial& material) {
  HexRows rows;
  const double h = lattice.grid.cell_m;
  rows.cell_m = static_cast<float>(h);
  rows.bulk_over_shear = static_cast<float>(material.bulk_pa / material.shear_pa);
  rows.omega2_per_shear = static_cast<float>(4 * material.shear_pa / (material.density_kg_per_m3 * h * h));
  rows.batches.resize((lattice.cells.size() + kLanes - 1) / kLanes);
  for (std::size_t b = 0; b < rows.batches.size(); ++b) {
    HexBatch& batch = rows.batches[b];
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const bool used = kLanes * b + lane < lattice.cells.size();
      const HexCell& cell = lattice.cells[kLanes * b + (used ? lane : 0)];
      for (std::size_t c = 0; c < 8; ++c) batch.offset[c][lane] = byte_offset(cell.nodes[c]);
      if (!used) continue;
      const double weight = cell.fill * cell.stiffness;
      batch.shear[lane] = static_cast<float>(weight * material.shear_pa * h / 16);
      batch.bulk[lane] = static_cast<float>(weight * material.bulk_pa / 64);
      batch.stiffness[lane] = static_cast<float>(cell.stiffness);
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
