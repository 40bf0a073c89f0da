// Arithmetic and memory access on SIMD registers, written once for both widths. R names the registers and their
// operations: Avx2 (simd_avx2.h) or Avx512 (simd_avx512.h). Only *_loop_avx*.cpp instantiate these templates; as every
// R is in an unnamed namespace, no function compiled for one instruction set is linked in place of one for another.
//
// State in memory is an array of entries of four floats {x y z w}, addressed by byte offsets. Register i of the four
// that R::load_entries() and the *_entries() of R take holds the entries i, i + 4, i + 8 ... of a batch.
#pragma once

#include <immintrin.h>

#include <cstdint>

namespace sectio {

// Vectors of which each component fills a register: one vector a lane.
template <class R>
struct Lanes3 {
  typename R::Reg x, y, z;
};

template <class R>
struct Lanes4 {
  typename R::Reg x, y, z, w;
};

template <class R>
[[gnu::always_inline]] inline typename R::Reg dot(const Lanes3<R>& a, const Lanes3<R>& b) {
  return R::fma(a.x, b.x, R::fma(a.y, b.y, R::mul(a.z, b.z)));
}

template <class R>
[[gnu::always_inline]] inline Lanes3<R> cross(const Lanes3<R>& a, const Lanes3<R>& b) {
  return {R::minus_fma(a.z, b.y, R::mul(a.y, b.z)), R::minus_fma(a.x, b.z, R::mul(a.z, b.x)),
          R::minus_fma(a.y, b.x, R::mul(a.x, b.y))};
}

// One vector a lane, from the R::kWidth entries at these offsets.
template <class R>
[[gnu::always_inline]] inline Lanes4<R> gather4(const char* base, const std::uint32_t* offset) {
  using Reg = typename R::Reg;
  const Reg r0 = R::load_entries(base, offset), r1 = R::load_entries(base, offset + 1);
  const Reg r2 = R::load_entries(base, offset + 2), r3 = R::load_entries(base, offset + 3);
  const Reg xy01 = R::unpack_low(r0, r1), xy23 = R::unpack_low(r2, r3);
  const Reg zw01 = R::unpack_high(r0, r1), zw23 = R::unpack_high(r2, r3);
  return {R::low_halves(xy01, xy23), R::high_halves(xy01, xy23), R::low_halves(zw01, zw23), R::high_halves(zw01, zw23)};
}

template <class R>
[[gnu::always_inline]] inline Lanes3<R> gather(const char* base, const std::uint32_t* offset) {
  const Lanes4<R> all = gather4<R>(base, offset);
  return {all.x, all.y, all.z};
}

// The transpose back to entries.
template <class R>
struct Entries {
  typename R::Reg of[4];
};

template <class R>
[[gnu::always_inline]] inline Entries<R> entries_of(const Lanes4<R>& lanes) {
  using Reg = typename R::Reg;
  const Reg xy_low = R::unpack_low(lanes.x, lanes.y), xy_high = R::unpack_high(lanes.x, lanes.y);
  const Reg zw_low = R::unpack_low(lanes.z, lanes.w), zw_high = R::unpack_high(lanes.z, lanes.w);
  return {{R::low_halves(xy_low, zw_low), R::high_halves(xy_low, zw_low), R::low_halves(xy_high, zw_high),
           R::high_halves(xy_high, zw_high)}};
}

// Stores the first `count` lanes.
template <class R>
[[gnu::always_inline]] inline void scatter4(const Lanes4<R>& lanes, char* base, const std::uint32_t* offset,
                                            int count) {
  R::store_entries(entries_of<R>(lanes).of, base, offset, count);
}

template <class R>
[[gnu::always_inline]] inline void scatter(const Lanes3<R>& lanes, char* base, const std::uint32_t* offset, int count) {
  scatter4<R>({lanes.x, lanes.y, lanes.z, R::all(0)}, base, offset, count);
}

// Adds the lanes to the entries, lane after lane in groups of eight, as two lanes may name the same entry. The second
// eight of a register of 16 are left in `later` (32 floats): R::add_later() adds them once the first eight lanes have
// been added for all corners, so that both widths add in the same order.
template <class R>
[[gnu::always_inline]] inline void add_scattered(const Lanes3<R>& lanes, char* base, const std::uint32_t* offset,
                                                 float* later) {
  R::add_entries(entries_of<R>({lanes.x, lanes.y, lanes.z, R::all(0)}).of, base, offset, later);
}

namespace {

[[gnu::always_inline]] inline void add_entry(char* to, __m128 by) {
  float* const sum = reinterpret_cast<float*>(to);
  _mm_store_ps(sum, _mm_add_ps(_mm_load_ps(sum), by));
}

}  // namespace
}  // namespace sectio
