#include "sim_server/deformation/spring_kernel.h"

#include <immintrin.h>

#include <cmath>

#include "common/core/error.h"
#include "sim_server/deformation/spring_loop.h"

namespace sectio {

bool has_avx512() {
  static const bool has = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                          __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  return has;
}

VelocityOutcome update_velocities(const SpringRows& rows, const VelocityUpdate& update,
                                  std::span<const Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                                  SimdWidth width) {
  const SpringLoopInput in{rows.slices().data(),
                           rows.slices().size(),
                           rows.columns().data(),
                           reinterpret_cast<const char*>(position_world_m.data()),
                           reinterpret_cast<char*>(velocity_m_per_s.data()),
                           update.damping_factor,
                           {update.gravity_step.x(), update.gravity_step.y(), update.gravity_step.z()},
                           update.max_speed_m_per_s,
                           update.damper_s > 0 ? reinterpret_cast<const char*>(update.velocity_before.data()) : nullptr,
                           update.damper_s};
  return has_sixteen_lanes(width) ? spring_loop_avx512(in) : spring_loop_avx2(in);
}

void limit_speed(float* v, int lanes, std::uint32_t bad_lanes, const std::uint32_t* offset, float max_speed_m_per_s,
                 VelocityOutcome& outcome) {
  for (int i = 0; i < lanes; ++i) {
    if (!(bad_lanes & (1u << i))) continue;
    float& x = v[i];
    float& y = v[lanes + i];
    float& z = v[2 * lanes + i];
    const double speed = std::sqrt(double{x} * x + double{y} * y + double{z} * z);
    const bool finite = std::isfinite(speed);
    const float scale = finite ? static_cast<float>(max_speed_m_per_s / speed) : 0.0f;
    x = finite ? scale * x : 0.0f;
    y = finite ? scale * y : 0.0f;
    z = finite ? scale * z : 0.0f;
    if (finite) {
      ++outcome.clamped;
    } else if (outcome.not_finite == kNone) {
      outcome.not_finite = vertex_at(offset[i]);
    }
  }
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
