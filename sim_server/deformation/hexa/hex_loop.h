// The loop of hex_kernel.h over the cells, written once for registers of 8 and of 16 lanes; simd.h and spring_loop.h
// have the rules.
#pragma once

#include <cstddef>

#include "sim_server/deformation/hexa/hex_kernel.h"
#include "sim_server/deformation/simd.h"

namespace sectio {

struct HexLoopInput {
  const HexBatch* batches = nullptr;
  std::size_t batch_count = 0;
  const char* position = nullptr;
  char* force = nullptr;
  float cell_m = 0;
  float bulk_over_shear = 0;
  bool with_bound = false;
};

// The largest stiffness * (1 + kappa/mu |cof F|^2 + |kappa/mu (J - 1) - 1| |F|), or 0.
float hex_forces_avx2(const HexLoopInput& in);
float hex_forces_avx512(const HexLoopInput& in);

// a, b <- a + b, b - a.
template <class R>
[[gnu::always_inline]] inline void butterfly(Lanes3<R>& a, Lanes3<R>& b) {
  const Lanes3<R> sum{R::add(a.x, b.x), R::add(a.y, b.y), R::add(a.z, b.z)};
  b = {R::sub(b.x, a.x), R::sub(b.y, a.y), R::sub(b.z, a.z)};
  a = sum;
}

// a, b <- a - b, a + b: the transpose.
template <class R>
[[gnu::always_inline]] inline void transposed_butterfly(Lanes3<R>& a, Lanes3<R>& b) {
  const Lanes3<R> sum{R::add(a.x, b.x), R::add(a.y, b.y), R::add(a.z, b.z)};
  a = {R::sub(a.x, b.x), R::sub(a.y, b.y), R::sub(a.z, b.z)};
  b = sum;
}

template <class R>
[[gnu::always_inline]] inline Lanes3<R> times(typename R::Reg s, const Lanes3<R>& a) {
  return {R::mul(s, a.x), R::mul(s, a.y), R::mul(s, a.z)};
}

// s a + t b
template <class R>
[[gnu::always_inline]] inline Lanes3<R> combined(typename R::Reg s, const Lanes3<R>& a, typename R::Reg t,
                                                 const Lanes3<R>& b) {
  return {R::fma(s, a.x, R::mul(t, b.x)), R::fma(s, a.y, R::mul(t, b.y)), R::fma(s, a.z, R::mul(t, b.z))};
}

// Replaces modes by the forces conjugate to them. The bits of c say along which axes mode n[c] changes sign; n[0] is
// left alone. Returns the bound on the stiffness for each lane, or 0.
template <class R, bool kBound>
[[gnu::always_inline]] inline typename R::Reg stress_modes(const HexLoopInput& in, const HexBatch& batch, int first,
                                                           Lanes3<R> (&n)[8]) {
  using Reg = typename R::Reg;
  const float h = in.cell_m;
  const Reg shear = R::load(&batch.shear[first]);
  const Lanes3<R> yz = cross<R>(n[2], n[4]), zx = cross<R>(n[4], n[1]), xy = cross<R>(n[1], n[2]);
  // J - 1 = M_x . (M_y x M_z) / (4 h)^3 - 1
  const Reg swelling = R::fma(R::all(1 / (64 * h * h * h)), dot<R>(n[1], yz), R::all(-1));
  const Reg pressure = R::sub(R::mul(R::load(&batch.bulk[first]), swelling), R::mul(shear, R::all(1 / (4 * h))));
  Reg bound = R::all(0);
  if constexpr (kBound) {
    const Reg f2 =
        R::mul(R::all(1 / (16 * h * h)), R::add(dot<R>(n[1], n[1]), R::add(dot<R>(n[2], n[2]), dot<R>(n[4], n[4]))));
    const Reg c2 =
        R::mul(R::all(1 / (256 * h * h * h * h)), R::add(dot<R>(yz, yz), R::add(dot<R>(zx, zx), dot<R>(xy, xy))));
    const Reg ratio = R::all(in.bulk_over_shear), q = R::fma(ratio, swelling, R::all(-1));
    const Reg size = R::max(q, R::sub(R::all(0), q));
    bound = R::mul(R::load(&batch.stiffness[first]), R::fma(ratio, c2, R::fma(size, R::sqrt(f2), R::all(1))));
  }
  const Reg minus_shear = R::sub(R::all(0), shear), minus_pressure = R::sub(R::all(0), pressure);
  n[1] = combined<R>(minus_shear, n[1], minus_pressure, yz);
  n[2] = combined<R>(minus_shear, n[2], minus_pressure, zx);
  n[4] = combined<R>(minus_shear, n[4], minus_pressure, xy);
  const Reg two = R::mul(R::all(static_cast<float>(-2 * kHourglass)), shear);
  n[3] = times<R>(two, n[3]);
  n[5] = times<R>(two, n[5]);
  n[6] = times<R>(two, n[6]);
  n[7] = times<R>(R::mul(R::all(0.5f), two), n[7]);
  return bound;
}

template <class R, bool kBound>
[[gnu::always_inline]] inline float hex_forces(const HexLoopInput& in) {
  alignas(64) float later[8][2 * kLanes];
  auto most = R::all(0);
  for (const HexBatch* batch = in.batches; batch != in.batches + in.batch_count; ++batch)
    for (int first = 0; first < static_cast<int>(kLanes); first += R::kWidth) {
      Lanes3<R> n[8];
      for (int c = 0; c < 8; ++c) n[c] = gather<R>(in.position, &batch->offset[c][first]);
      for (int step = 1; step < 8; step *= 2)
        for (int c = 0; c < 8; ++c)
          if ((c & step) == 0) butterfly<R>(n[c], n[c | step]);
      most = R::max(most, stress_modes<R, kBound>(in, *batch, first, n));
      n[0] = {R::all(0), R::all(0), R::all(0)};
      for (int step = 1; step < 8; step *= 2)
        for (int c = 0; c < 8; ++c)
          if ((c & step) == 0) transposed_butterfly<R>(n[c], n[c | step]);
      for (int c = 0; c < 8; ++c) add_scattered<R>(n[c], in.force, &batch->offset[c][first], later[c]);
      for (int c = 0; c < 8; ++c) R::add_later(in.force, &batch->offset[c][first], later[c]);
    }
  if (!kBound) return 0;
  alignas(64) float lanes[R::kWidth];
  R::store(lanes, most);
  float largest = 0;
  for (const float lane : lanes) largest = lane > largest ? lane : largest;
  return largest;
}

}  // namespace sectio
