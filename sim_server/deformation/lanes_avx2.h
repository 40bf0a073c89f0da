// Registers of 8 floats (AVX2) for the loops that are written once for both widths. Only *_loop_avx2.cpp include this
// file; everything has internal linkage, so that no function compiled for one instruction set is linked for another's.
#pragma once

#include <immintrin.h>

#include "sim_server/deformation/lanes.h"

namespace sectio {
namespace {

// An entry of four floats.
[[gnu::always_inline]] inline void add_entry(char* to, __m128 by) {
  float* const sum = reinterpret_cast<float*>(to);
  _mm_store_ps(sum, _mm_add_ps(_mm_load_ps(sum), by));
}

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

struct Avx2 {
  using Reg = __m256;
  static constexpr int kWidth = 8;

  static Reg all(float a) { return _mm256_set1_ps(a); }
  static Reg load(const float* p) { return _mm256_load_ps(p); }
  static void store(float* p, Reg a) { _mm256_store_ps(p, a); }
  static Reg add(Reg a, Reg b) { return _mm256_add_ps(a, b); }
  static Reg max(Reg a, Reg b) { return _mm256_max_ps(a, b); }
  static Reg sub(Reg a, Reg b) { return _mm256_sub_ps(a, b); }
  static Reg mul(Reg a, Reg b) { return _mm256_mul_ps(a, b); }
  static Reg div(Reg a, Reg b) { return _mm256_div_ps(a, b); }
  static Reg sqrt(Reg a) { return _mm256_sqrt_ps(a); }
  static Reg fma(Reg a, Reg b, Reg c) { return _mm256_fmadd_ps(a, b, c); }
  static Reg minus_fma(Reg a, Reg b, Reg c) { return _mm256_fnmadd_ps(a, b, c); }
  static std::uint32_t not_less_equal(Reg a, Reg b) {
    return static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_NLE_UQ)));
  }

  // Eight entries {x y z w}, transposed to three registers.
  [[gnu::always_inline]] static Lanes4<Avx2> gather4(const char* base, const std::uint32_t* offset) {
    const __m256 r0 = load_pair(base, offset[0], offset[4]);
    const __m256 r1 = load_pair(base, offset[1], offset[5]);
    const __m256 r2 = load_pair(base, offset[2], offset[6]);
    const __m256 r3 = load_pair(base, offset[3], offset[7]);
    const __m256 xy01 = _mm256_unpacklo_ps(r0, r1);
    const __m256 xy23 = _mm256_unpacklo_ps(r2, r3);
    const __m256 zw01 = _mm256_unpackhi_ps(r0, r1);
    const __m256 zw23 = _mm256_unpackhi_ps(r2, r3);
    return {low_halves(xy01, xy23), high_halves(xy01, xy23), low_halves(zw01, zw23), high_halves(zw01, zw23)};
  }
  [[gnu::always_inline]] static Lanes3<Avx2> gather(const char* base, const std::uint32_t* offset) {
    const Lanes4<Avx2> all = gather4(base, offset);
    return {all.x, all.y, all.z};
  }

  // The inverse, for the first `count` lanes.
  [[gnu::always_inline]] static void scatter4(const Lanes4<Avx2>& lanes, char* base, const std::uint32_t* offset,
                                              int count) {
    const __m256 xy_low = _mm256_unpacklo_ps(lanes.x, lanes.y);
    const __m256 xy_high = _mm256_unpackhi_ps(lanes.x, lanes.y);
    const __m256 z_low = _mm256_unpacklo_ps(lanes.z, lanes.w);
    const __m256 z_high = _mm256_unpackhi_ps(lanes.z, lanes.w);
    const __m256 rows[4] = {low_halves(xy_low, z_low), high_halves(xy_low, z_low), low_halves(xy_high, z_high),
                            high_halves(xy_high, z_high)};
    const __m128 entries[kWidth] = {_mm256_castps256_ps128(rows[0]),   _mm256_castps256_ps128(rows[1]),
                                    _mm256_castps256_ps128(rows[2]),   _mm256_castps256_ps128(rows[3]),
                                    _mm256_extractf128_ps(rows[0], 1), _mm256_extractf128_ps(rows[1], 1),
                                    _mm256_extractf128_ps(rows[2], 1), _mm256_extractf128_ps(rows[3], 1)};
    if (count == kWidth) {
      for (int i = 0; i < kWidth; ++i) _mm_store_ps(reinterpret_cast<float*>(base + offset[i]), entries[i]);
    } else {
      for (int i = 0; i < count; ++i) _mm_store_ps(reinterpret_cast<float*>(base + offset[i]), entries[i]);
    }
  }
  // Adds the entries of a corner to what is there, lane after lane. `later`: unused.
  [[gnu::always_inline]] static void add_scattered(const Lanes3<Avx2>& lanes, char* base, const std::uint32_t* offset,
                                                   float* /*later*/) {
    const __m256 xy_low = _mm256_unpacklo_ps(lanes.x, lanes.y);
    const __m256 xy_high = _mm256_unpackhi_ps(lanes.x, lanes.y);
    const __m256 z_low = _mm256_unpacklo_ps(lanes.z, all(0));
    const __m256 z_high = _mm256_unpackhi_ps(lanes.z, all(0));
    const __m256 rows[4] = {low_halves(xy_low, z_low), high_halves(xy_low, z_low), low_halves(xy_high, z_high),
                            high_halves(xy_high, z_high)};
    for (int i = 0; i < 4; ++i) add_entry(base + offset[i], _mm256_castps256_ps128(rows[i]));
    for (int i = 0; i < 4; ++i) add_entry(base + offset[4 + i], _mm256_extractf128_ps(rows[i], 1));
  }
  static void add_later(char* /*base*/, const std::uint32_t* /*offset*/, const float* /*later*/) {}
  [[gnu::always_inline]] static void scatter(const Lanes3<Avx2>& lanes, char* base, const std::uint32_t* offset,
                                             int count) {
    scatter4({lanes.x, lanes.y, lanes.z, all(0)}, base, offset, count);
  }
};

}  // namespace
}  // namespace sectio
