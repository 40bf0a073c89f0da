#include "sim_server/deformation/spring_kernel.h"

#include <immintrin.h>

#include <cmath>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr int kHalf = 8;  // lanes of an AVX register

struct Lanes {
  __m256 x, y, z;
};

[[gnu::always_inline]] inline __m256 load_pair(const char* base, std::uint32_t low, std::uint32_t high) {
  const __m128 a = _mm_load_ps(reinterpret_cast<const float*>(base + low));
  const __m128 b = _mm_load_ps(reinterpret_cast<const float*>(base + high));
  return _mm256_insertf128_ps(_mm256_castps128_ps256(a), b, 1);
}

[[gnu::always_inline]] inline __m256 low_halves(__m256 a, __m256 b) {
  return _mm256_castpd_ps(_mm256_unpacklo_pd(_mm256_castps_pd(a), _mm256_castps_pd(b)));
}
[[gnu::always_inline]] inline __m256 high_halves(__m256 a, __m256 b) {
  return _mm256_castpd_ps(_mm256_unpackhi_pd(_mm256_castps_pd(a), _mm256_castps_pd(b)));
}

// Eight entries {x y z w}, transposed to three registers of eight.
[[gnu::always_inline]] inline Lanes gather(const char* base, const std::uint32_t* offset) {
  const __m256 r0 = load_pair(base, offset[0], offset[4]);
  const __m256 r1 = load_pair(base, offset[1], offset[5]);
  const __m256 r2 = load_pair(base, offset[2], offset[6]);
  const __m256 r3 = load_pair(base, offset[3], offset[7]);
  const __m256 xy01 = _mm256_unpacklo_ps(r0, r1);
  const __m256 xy23 = _mm256_unpacklo_ps(r2, r3);
  const __m256 zw01 = _mm256_unpackhi_ps(r0, r1);
  const __m256 zw23 = _mm256_unpackhi_ps(r2, r3);
  return {low_halves(xy01, xy23), high_halves(xy01, xy23), low_halves(zw01, zw23)};
}

// The inverse, for the first `count` of eight lanes.
[[gnu::always_inline]] inline void scatter(const Lanes& lanes, char* base, const std::uint32_t* offset, int count) {
  const __m256 zero = _mm256_setzero_ps();
  const __m256 xy_low = _mm256_unpacklo_ps(lanes.x, lanes.y);
  const __m256 xy_high = _mm256_unpackhi_ps(lanes.x, lanes.y);
  const __m256 z_low = _mm256_unpacklo_ps(lanes.z, zero);
  const __m256 z_high = _mm256_unpackhi_ps(lanes.z, zero);
  const __m256 rows[4] = {low_halves(xy_low, z_low), high_halves(xy_low, z_low), low_halves(xy_high, z_high),
                          high_halves(xy_high, z_high)};
  const __m128 entries[kHalf] = {_mm256_castps256_ps128(rows[0]),   _mm256_castps256_ps128(rows[1]),
                                 _mm256_castps256_ps128(rows[2]),   _mm256_castps256_ps128(rows[3]),
                                 _mm256_extractf128_ps(rows[0], 1), _mm256_extractf128_ps(rows[1], 1),
                                 _mm256_extractf128_ps(rows[2], 1), _mm256_extractf128_ps(rows[3], 1)};
  if (count >= kHalf) {
    for (int i = 0; i < kHalf; ++i) _mm_store_ps(reinterpret_cast<float*>(base + offset[i]), entries[i]);
  } else {
    for (int i = 0; i < count; ++i) _mm_store_ps(reinterpret_cast<float*>(base + offset[i]), entries[i]);
  }
}

// Added to l^2: padding has l = 0 and must give 0 / l = 0. Far below the rounding of any real edge's l^2.
constexpr float kNoDivisionByZero = 1e-20f;

[[gnu::always_inline]] inline Lanes spring_force(const char* x, const Lanes& own, const SpringColumn* columns,
                                                 std::uint32_t width, int first_lane) {
  Lanes force{_mm256_setzero_ps(), _mm256_setzero_ps(), _mm256_setzero_ps()};
  const __m256 tiny = _mm256_set1_ps(kNoDivisionByZero);
  for (std::uint32_t n = 0; n < width; ++n) {
    const SpringColumn& column = columns[n];
    const Lanes other = gather(x, column.offset.data() + first_lane);
    const __m256 dx = _mm256_sub_ps(other.x, own.x);
    const __m256 dy = _mm256_sub_ps(other.y, own.y);
    const __m256 dz = _mm256_sub_ps(other.z, own.z);
    const __m256 l2 = _mm256_fmadd_ps(dx, dx, _mm256_fmadd_ps(dy, dy, _mm256_fmadd_ps(dz, dz, tiny)));
    const __m256 k = _mm256_load_ps(column.k.data() + first_lane);
    const __m256 k_l0 = _mm256_load_ps(column.k_l0.data() + first_lane);
    // k - k l0 / l as k - l (k l0 / l^2): the root and the quotient then do not wait for each other.
    const __m256 c = _mm256_fnmadd_ps(_mm256_sqrt_ps(l2), _mm256_div_ps(k_l0, l2), k);
    force.x = _mm256_fmadd_ps(c, dx, force.x);
    force.y = _mm256_fmadd_ps(c, dy, force.y);
    force.z = _mm256_fmadd_ps(c, dz, force.z);
  }
  return force;
}

// h/m (f + k_h (home - x)) + s h g + damping v
[[gnu::always_inline]] inline __m256 new_velocity(__m256 force, __m256 k_home, const float* home, __m256 x,
                                                  __m256 step_over_mass, __m256 share, float gravity_step,
                                                  __m256 damping, __m256 v) {
  const __m256 total = _mm256_fmadd_ps(k_home, _mm256_sub_ps(_mm256_load_ps(home), x), force);
  const __m256 pushed = _mm256_fmadd_ps(step_over_mass, total, _mm256_mul_ps(damping, v));
  return _mm256_fmadd_ps(share, _mm256_set1_ps(gravity_step), pushed);
}

// Rare: some lane is faster than the cap or not finite.
void limit(Lanes& v, int bad_lanes, const std::uint32_t* offset, float max_speed, VelocityOutcome& outcome) {
  alignas(32) float x[kHalf], y[kHalf], z[kHalf];
  _mm256_store_ps(x, v.x);
  _mm256_store_ps(y, v.y);
  _mm256_store_ps(z, v.z);
  for (int i = 0; i < kHalf; ++i) {
    if (!(bad_lanes & (1 << i))) continue;
    const double speed = std::sqrt(double{x[i]} * x[i] + double{y[i]} * y[i] + double{z[i]} * z[i]);
    const bool finite = std::isfinite(speed);
    const float scale = finite ? static_cast<float>(max_speed / speed) : 0.0f;
    x[i] = finite ? scale * x[i] : 0.0f;
    y[i] = finite ? scale * y[i] : 0.0f;
    z[i] = finite ? scale * z[i] : 0.0f;
    if (finite) {
      ++outcome.clamped;
    } else if (outcome.not_finite == kNone) {
      outcome.not_finite = vertex_at(offset[i]);
    }
  }
  v = {_mm256_load_ps(x), _mm256_load_ps(y), _mm256_load_ps(z)};
}

}  // namespace

VelocityOutcome update_velocities(const SpringRows& rows, const VelocityUpdate& update,
                                  std::span<const Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) {
  VelocityOutcome outcome;
  const char* const x = reinterpret_cast<const char*>(position_world_m.data());
  char* const v = reinterpret_cast<char*>(velocity_m_per_s.data());
  const __m256 damping = _mm256_set1_ps(update.damping_factor);
  const __m256 max_speed2 = _mm256_set1_ps(update.max_speed_m_per_s * update.max_speed_m_per_s);
  const Vec3f g = update.gravity_step;
  for (const SpringSlice& slice : rows.slices()) {
    const SpringColumn* const columns = rows.columns().data() + slice.first_column;
    for (int first = 0; first < static_cast<int>(slice.count); first += kHalf) {
      const std::uint32_t* const offset = slice.offset.data() + first;
      const Lanes own = gather(x, offset);
      const Lanes old = gather(v, offset);
      const Lanes force = spring_force(x, own, columns, slice.width, first);
      const __m256 k_home = _mm256_load_ps(slice.k_home.data() + first);
      const __m256 push = _mm256_load_ps(slice.step_over_mass.data() + first);
      const __m256 share = _mm256_load_ps(slice.gravity_share.data() + first);
      Lanes now{new_velocity(force.x, k_home, slice.home_x.data() + first, own.x, push, share, g.x(), damping, old.x),
                new_velocity(force.y, k_home, slice.home_y.data() + first, own.y, push, share, g.y(), damping, old.y),
                new_velocity(force.z, k_home, slice.home_z.data() + first, own.z, push, share, g.z(), damping, old.z)};
      const __m256 speed2 = _mm256_fmadd_ps(now.x, now.x, _mm256_fmadd_ps(now.y, now.y, _mm256_mul_ps(now.z, now.z)));
      const int live = (1 << std::min(kHalf, static_cast<int>(slice.count) - first)) - 1;
      const int bad = live & _mm256_movemask_ps(_mm256_cmp_ps(speed2, max_speed2, _CMP_NLE_UQ));
      if (bad != 0) [[unlikely]]
        limit(now, bad, offset, update.max_speed_m_per_s, outcome);
      scatter(now, v, offset, static_cast<int>(slice.count) - first);
    }
  }
  return outcome;
}

void update_positions(float step_s, std::span<const Vec4f> velocity_m_per_s, std::span<Vec4f> position_world_m) {
  SECTIO_ASSERT(velocity_m_per_s.size() == position_world_m.size(), "one velocity a position");
  const float* const v = reinterpret_cast<const float*>(velocity_m_per_s.data());
  float* const x = reinterpret_cast<float*>(position_world_m.data());
  const std::size_t floats = 4 * position_world_m.size();
  const __m256 h = _mm256_set1_ps(step_s);
  std::size_t i = 0;
  for (; i + 8 <= floats; i += 8) {
    _mm256_storeu_ps(x + i, _mm256_fmadd_ps(h, _mm256_loadu_ps(v + i), _mm256_loadu_ps(x + i)));
  }
  for (; i < floats; ++i) x[i] = std::fma(step_s, v[i], x[i]);
}

}  // namespace sectio
