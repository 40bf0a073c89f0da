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

// The largest s_e (1 + kappa/mu |cof F|^2 + |kappa/mu (J - 1) - 1| |F|), or 0.
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

// a += s b
template <class R>
[[gnu::always_inline]] inline void add_times(Lanes3<R>& a, typename R::Reg s, const Lanes3<R>& b) {
  a = {R::fma(s, b.x, a.x), R::fma(s, b.y, a.y), R::fma(s, b.z, a.z)};
}

template <class R>
[[gnu::always_inline]] inline typename R::Reg squared(const Lanes3<R>& a) {
  return dot<R>(a, a);
}

// From modes about the middle of the cell to modes about the centroid d of its material, and the transpose.
template <class R>
[[gnu::always_inline]] inline void shift(const typename R::Reg (&d)[3], Lanes3<R> (&n)[8]) {
  add_times<R>(n[1], d[2], n[5]);
  add_times<R>(n[2], d[2], n[6]);
  add_times<R>(n[4], d[1], n[6]);
  add_times<R>(n[3], d[2], n[7]);
  add_times<R>(n[5], d[1], n[7]);
  add_times<R>(n[6], d[0], n[7]);
  add_times<R>(n[1], d[1], n[3]);
  add_times<R>(n[2], d[0], n[3]);
  add_times<R>(n[4], d[0], n[5]);
}
template <class R>
[[gnu::always_inline]] inline void shift_back(const typename R::Reg (&d)[3], Lanes3<R> (&f)[8]) {
  add_times<R>(f[5], d[0], f[4]);
  add_times<R>(f[3], d[1], f[1]);
  add_times<R>(f[3], d[0], f[2]);
  add_times<R>(f[7], d[2], f[3]);
  add_times<R>(f[7], d[1], f[5]);
  add_times<R>(f[7], d[0], f[6]);
  add_times<R>(f[5], d[2], f[1]);
  add_times<R>(f[6], d[2], f[2]);
  add_times<R>(f[6], d[1], f[4]);
}

// The forces on hourglasses, and in `to` the twist term's share of those on slopes. t = tau f a / (4 h); returns its
// energy over t.
template <class R>
[[gnu::always_inline]] inline typename R::Reg twist(const typename R::Reg (&i)[3], typename R::Reg springs,
                                                    typename R::Reg t, Lanes3<R> (&n)[8], Lanes3<R> (&to)[3]) {
  using Reg = typename R::Reg;
  const Lanes3<R> b3 = n[3], b5 = n[5], b6 = n[6];
  to[0] = times<R>(i[0], cross<R>(b3, b5));
  to[1] = times<R>(i[1], cross<R>(b6, b3));
  to[2] = times<R>(i[2], cross<R>(b5, b6));
  const Reg tx = R::mul(t, i[0]), ty = R::mul(t, i[1]), tz = R::mul(t, i[2]);
  const auto spring = [&](Reg sum) { return R::sub(R::all(0), R::mul(springs, sum)); };
  n[3] = times<R>(spring(R::add(i[0], i[1])), b3);
  n[5] = times<R>(spring(R::add(i[0], i[2])), b5);
  n[6] = times<R>(spring(R::add(i[1], i[2])), b6);
  n[7] = times<R>(spring(R::fma(i[0], i[1], R::fma(i[1], i[2], R::mul(i[2], i[0])))), n[7]);
  add_times<R>(n[3], tx, cross<R>(b5, n[1]));
  add_times<R>(n[3], ty, cross<R>(n[2], b6));
  add_times<R>(n[5], tx, cross<R>(n[1], b3));
  add_times<R>(n[5], tz, cross<R>(b6, n[4]));
  add_times<R>(n[6], ty, cross<R>(b3, n[2]));
  add_times<R>(n[6], tz, cross<R>(n[4], b5));
  return R::add(dot<R>(n[1], to[0]), R::add(dot<R>(n[2], to[1]), dot<R>(n[4], to[2])));
}

// Replaces modes by the forces conjugate to them. The bits of c say along which axes mode n[c] changes sign; n[0] is
// left alone. Returns the bound on the stiffness for each lane, or 0.
template <class R, bool kBound>
[[gnu::always_inline]] inline typename R::Reg stress_modes(const HexLoopInput& in, const HexBatch& batch, int first,
                                                           Lanes3<R> (&n)[8]) {
  using Reg = typename R::Reg;
  const float h = in.cell_m;
  const Reg shear = R::load(&batch.shear[first]);
  Reg d[3], i[3];
  for (int k = 0; k < 3; ++k) {
    d[k] = R::load(&batch.offset_of_material[k][first]);
    i[k] = R::load(&batch.spread[k][first]);
  }
  shift<R>(d, n);
  const Lanes3<R> yz = cross<R>(n[2], n[4]), zx = cross<R>(n[4], n[1]), xy = cross<R>(n[1], n[2]);
  // J - 1 = M_x . (M_y x M_z) / (4 h)^3 - 1
  const Reg swelling = R::fma(R::all(1 / (64 * h * h * h)), dot<R>(n[1], yz), R::all(-1));
  const Reg pressure = R::sub(R::mul(R::load(&batch.bulk[first]), swelling), R::mul(shear, R::all(1 / (4 * h))));
  // |F|^2 / 3
  const Reg size2 =
      R::mul(R::all(1 / (48 * h * h)), R::add(squared<R>(n[1]), R::add(squared<R>(n[2]), squared<R>(n[4]))));
  Reg bound = R::all(0);
  if constexpr (kBound) {
    const Reg f2 = R::mul(R::all(3), size2);
    const Reg c2 =
        R::mul(R::all(1 / (256 * h * h * h * h)), R::add(squared<R>(yz), R::add(squared<R>(zx), squared<R>(xy))));
    const Reg ratio = R::all(in.bulk_over_shear), q = R::fma(ratio, swelling, R::all(-1));
    const Reg size = R::max(q, R::sub(R::all(0), q));
    bound = R::mul(R::load(&batch.stiffness[first]), R::fma(ratio, c2, R::fma(size, R::sqrt(f2), R::all(1))));
  }
  const Reg hourglasses = R::add(squared<R>(n[3]), R::add(squared<R>(n[5]), squared<R>(n[6])));
  const Reg limit = R::div(
      R::all(2), R::add(R::all(1), R::fma(R::all(static_cast<float>(kTangle) / (48 * h * h)), hourglasses, size2)));
  const Reg t = R::mul(R::all(static_cast<float>(kTwist) / (4 * h)), R::mul(limit, shear));
  const Lanes3<R> b3 = n[3], b5 = n[5], b6 = n[6];
  Lanes3<R> turned[3];
  const Reg twisted = twist<R>(i, R::mul(R::all(static_cast<float>(3 * kHourglass)), shear), t, n, turned);
  const Reg less = R::mul(R::mul(t, limit), R::mul(R::all(1 / (48 * h * h)), twisted)), held = R::add(less, shear);
  const Reg tangled = R::mul(R::all(static_cast<float>(-kTangle)), less);
  add_times<R>(n[3], tangled, b3);
  add_times<R>(n[5], tangled, b5);
  add_times<R>(n[6], tangled, b6);
  const Reg minus_held = R::sub(R::all(0), held), minus_pressure = R::sub(R::all(0), pressure);
  n[1] = combined<R>(minus_held, n[1], minus_pressure, yz);
  n[2] = combined<R>(minus_held, n[2], minus_pressure, zx);
  n[4] = combined<R>(minus_held, n[4], minus_pressure, xy);
  add_times<R>(n[1], t, turned[0]);
  add_times<R>(n[2], t, turned[1]);
  add_times<R>(n[4], t, turned[2]);
  shift_back<R>(d, n);
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
