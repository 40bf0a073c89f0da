// The velocity loop of the springs, written once for registers of 8 lanes (AVX2) and of 16 (AVX-512); simd.h says what
// R is. Each lane sees the same operations in the same order, so every R gives the same bits. Only *_loop_avx*.cpp
// instantiate the loop, each compiled for its own instruction set.
#pragma once

#include <algorithm>

#include "sim_server/deformation/simd.h"
#include "sim_server/deformation/spring_kernel.h"

namespace sectio {

// The arguments of update_velocities() as plain data: inline code of Eigen or the standard library must not be compiled
// for AVX-512, since the linker could use it in the rest of the program.
struct SpringLoopInput {
  const SpringSlice* slices;
  std::size_t slice_count;
  const SpringColumn* columns;
  const char* position;  // {x y z 0}, by byte offset
  char* velocity;
  float damping_factor;
  float gravity_step[3];
  float max_speed_m_per_s;
  const char* velocity_before;  // a copy of all velocities, where springs have dampers
  float damper_s;               // constant of a damper over that of its spring
};

VelocityOutcome spring_loop_avx2(const SpringLoopInput& in);
VelocityOutcome spring_loop_avx512(const SpringLoopInput& in);

// Limits the speed of the lanes in `bad_lanes`, which are faster than the cap or not finite (rare). v holds all x, then
// all y, then all z.
void limit_speed(float* v, int lanes, std::uint32_t bad_lanes, const std::uint32_t* offset, float max_speed_m_per_s,
                 VelocityOutcome& outcome);

// Limits the velocities of the first `count` lanes to the cap.
template <class R>
[[gnu::always_inline]] inline Lanes3<R> limited(const Lanes3<R>& v, int count, const std::uint32_t* offset,
                                                float max_speed_m_per_s, VelocityOutcome& outcome) {
  const auto max_speed2 = R::all(max_speed_m_per_s * max_speed_m_per_s);
  const std::uint32_t bad = R::not_less_equal(dot<R>(v, v), max_speed2) & ((1u << count) - 1u);
  if (bad == 0) [[likely]]
    return v;
  alignas(64) float lanes[3 * R::kWidth];
  R::store(lanes, v.x);
  R::store(lanes + R::kWidth, v.y);
  R::store(lanes + 2 * R::kWidth, v.z);
  limit_speed(lanes, R::kWidth, bad, offset, max_speed_m_per_s, outcome);
  return {R::load(lanes), R::load(lanes + R::kWidth), R::load(lanes + 2 * R::kWidth)};
}

// Added to l^2, so that padding, which has l = 0, gives 0 / l = 0. Far below the rounding of any real edge's l^2.
constexpr float kNoDivisionByZero = 1e-20f;

template <class R, bool kDampers>
[[gnu::always_inline]] inline Lanes3<R> spring_force(const SpringLoopInput& in, const Lanes3<R>& own,
                                                     const Lanes3<R>& own_velocity, const SpringColumn* column,
                                                     std::uint32_t width, int first_lane) {
  using Reg = typename R::Reg;
  Lanes3<R> force{R::all(0), R::all(0), R::all(0)};
  const Reg tiny = R::all(kNoDivisionByZero);
  for (const SpringColumn* const end = column + width; column != end; ++column) {
    const Lanes3<R> other = gather<R>(in.position, &column->offset[first_lane]);
    const Reg dx = R::sub(other.x, own.x);
    const Reg dy = R::sub(other.y, own.y);
    const Reg dz = R::sub(other.z, own.z);
    const Reg l2 = R::fma(dx, dx, R::fma(dy, dy, R::fma(dz, dz, tiny)));
    // k - k l0 / l as k - l (k l0 / l^2): the root and the quotient then do not wait for each other.
    const Reg k = R::load(&column->k[first_lane]);
    Reg c = R::minus_fma(R::sqrt(l2), R::div(R::load(&column->k_l0[first_lane]), l2), k);
    if constexpr (kDampers) {
      // + damper_s k (d . dv) / l^2
      const Lanes3<R> v = gather<R>(in.velocity_before, &column->offset[first_lane]);
      const Reg approach = R::fma(dx, R::sub(v.x, own_velocity.x),
                                  R::fma(dy, R::sub(v.y, own_velocity.y), R::mul(dz, R::sub(v.z, own_velocity.z))));
      c = R::fma(R::mul(R::all(in.damper_s), k), R::div(approach, l2), c);
    }
    force.x = R::fma(c, dx, force.x);
    force.y = R::fma(c, dy, force.y);
    force.z = R::fma(c, dz, force.z);
  }
  return force;
}

// The new velocity h/m (f + k_h (home - x)) + s h g + damping v of some lanes of a slice.
template <class R>
struct VertexLanes {
  typename R::Reg k_home, step_over_mass, share, damping;

  [[gnu::always_inline]] typename R::Reg new_velocity(typename R::Reg force, const float* home, typename R::Reg x,
                                                      float gravity_step, typename R::Reg v) const {
    const auto total = R::fma(k_home, R::sub(R::load(home), x), force);
    const auto pushed = R::fma(step_over_mass, total, R::mul(damping, v));
    return R::fma(share, R::all(gravity_step), pushed);
  }
};

template <class R, bool kDampers>
[[gnu::always_inline]] inline VelocityOutcome spring_loop(const SpringLoopInput& in) {
  VelocityOutcome outcome;
  const auto damping = R::all(in.damping_factor);
  for (const SpringSlice* slice = in.slices; slice != in.slices + in.slice_count; ++slice) {
    for (int first = 0; first < static_cast<int>(slice->count); first += R::kWidth) {
      const std::uint32_t* const offset = &slice->offset[first];
      const Lanes3<R> x = gather<R>(in.position, offset);
      const Lanes3<R> v = gather<R>(in.velocity, offset);
      const Lanes3<R> force =
          spring_force<R, kDampers>(in, x, v, in.columns + slice->first_column, slice->width, first);
      const VertexLanes<R> vertex{R::load(&slice->k_home[first]), R::load(&slice->step_over_mass[first]),
                                  R::load(&slice->gravity_share[first]), damping};
      const Lanes3<R> now{vertex.new_velocity(force.x, &slice->home_x[first], x.x, in.gravity_step[0], v.x),
                          vertex.new_velocity(force.y, &slice->home_y[first], x.y, in.gravity_step[1], v.y),
                          vertex.new_velocity(force.z, &slice->home_z[first], x.z, in.gravity_step[2], v.z)};
      const int count = std::min(R::kWidth, static_cast<int>(slice->count) - first);
      scatter<R>(limited<R>(now, count, offset, in.max_speed_m_per_s, outcome), in.velocity, offset, count);
    }
  }
  return outcome;
}

}  // namespace sectio
