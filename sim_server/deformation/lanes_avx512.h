// Registers of 16 floats (AVX-512), as lanes_avx2.h. Only *_loop_avx512.cpp include this file; they are compiled with
// AVX-512 whatever the rest of the program is compiled for: call them only where has_avx512() holds.
#pragma once

#include <immintrin.h>

#include "sim_server/deformation/lanes.h"

namespace sectio {
namespace {

[[gnu::always_inline]] inline void add_entry(char* to, __m128 by) {
  float* const sum = reinterpret_cast<float*>(to);
  _mm_store_ps(sum, _mm_add_ps(_mm_load_ps(sum), by));
}

[[gnu::always_inline]] inline __m512 load_four(const char* base, const std::uint32_t* offset) {
  const auto at = [&](int i) { return _mm_load_ps(reinterpret_cast<const float*>(base + offset[i])); };
  const __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(at(0)), at(4), 1);
  const __m256 high = _mm256_insertf128_ps(_mm256_castps128_ps256(at(8)), at(12), 1);
  return _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
}

[[gnu::always_inline]] inline __m512 low_halves(__m512 a, __m512 b) {
  return _mm512_castpd_ps(_mm512_unpacklo_pd(_mm512_castps_pd(a), _mm512_castps_pd(b)));
}
[[gnu::always_inline]] inline __m512 high_halves(__m512 a, __m512 b) {
  return _mm512_castpd_ps(_mm512_unpackhi_pd(_mm512_castps_pd(a), _mm512_castps_pd(b)));
}

struct Avx512 {
  using Reg = __m512;
  static constexpr int kWidth = 16;

  static Reg all(float a) { return _mm512_set1_ps(a); }
  static Reg load(const float* p) { return _mm512_load_ps(p); }
  static void store(float* p, Reg a) { _mm512_store_ps(p, a); }
  static Reg add(Reg a, Reg b) { return _mm512_add_ps(a, b); }
  static Reg max(Reg a, Reg b) { return _mm512_max_ps(a, b); }
  static Reg sub(Reg a, Reg b) { return _mm512_sub_ps(a, b); }
  static Reg mul(Reg a, Reg b) { return _mm512_mul_ps(a, b); }
  static Reg div(Reg a, Reg b) { return _mm512_div_ps(a, b); }
  static Reg sqrt(Reg a) { return _mm512_sqrt_ps(a); }
  static Reg fma(Reg a, Reg b, Reg c) { return _mm512_fmadd_ps(a, b, c); }
  static Reg minus_fma(Reg a, Reg b, Reg c) { return _mm512_fnmadd_ps(a, b, c); }
  static std::uint32_t not_less_equal(Reg a, Reg b) { return _mm512_cmp_ps_mask(a, b, _CMP_NLE_UQ); }

  // Sixteen entries {x y z w}, transposed to three registers.
  [[gnu::always_inline]] static Lanes4<Avx512> gather4(const char* base, const std::uint32_t* offset) {
    const __m512 r0 = load_four(base, offset);
    const __m512 r1 = load_four(base, offset + 1);
    const __m512 r2 = load_four(base, offset + 2);
    const __m512 r3 = load_four(base, offset + 3);
    const __m512 xy01 = _mm512_unpacklo_ps(r0, r1);
    const __m512 xy23 = _mm512_unpacklo_ps(r2, r3);
    const __m512 zw01 = _mm512_unpackhi_ps(r0, r1);
    const __m512 zw23 = _mm512_unpackhi_ps(r2, r3);
    return {low_halves(xy01, xy23), high_halves(xy01, xy23), low_halves(zw01, zw23), high_halves(zw01, zw23)};
  }
  [[gnu::always_inline]] static Lanes3<Avx512> gather(const char* base, const std::uint32_t* offset) {
    const Lanes4<Avx512> all = gather4(base, offset);
    return {all.x, all.y, all.z};
  }

  // The inverse, for the first `count` lanes.
  [[gnu::always_inline]] static void scatter4(const Lanes4<Avx512>& lanes, char* base, const std::uint32_t* offset,
                                              int count) {
    const __m512 xy_low = _mm512_unpacklo_ps(lanes.x, lanes.y);
    const __m512 xy_high = _mm512_unpackhi_ps(lanes.x, lanes.y);
    const __m512 z_low = _mm512_unpacklo_ps(lanes.z, lanes.w);
    const __m512 z_high = _mm512_unpackhi_ps(lanes.z, lanes.w);
    const __m512 rows[4] = {low_halves(xy_low, z_low), high_halves(xy_low, z_low), low_halves(xy_high, z_high),
                            high_halves(xy_high, z_high)};
    const auto entry = [&](int i) { return reinterpret_cast<float*>(base + offset[i]); };
    if (count == kWidth) [[likely]] {
      for (int i = 0; i < 4; ++i) {  // by halves: a quarter of 512 bits is two cycles a store on Zen 4
        const __m256 low = _mm512_castps512_ps256(rows[i]);
        const __m256 high = _mm512_extractf32x8_ps(rows[i], 1);
        _mm_store_ps(entry(i), _mm256_castps256_ps128(low));
        _mm_store_ps(entry(i + 4), _mm256_extractf128_ps(low, 1));
        _mm_store_ps(entry(i + 8), _mm256_castps256_ps128(high));
        _mm_store_ps(entry(i + 12), _mm256_extractf128_ps(high, 1));
      }
    } else {
      alignas(64) float quads[4][kWidth];
      for (int i = 0; i < 4; ++i) _mm512_store_ps(quads[i], rows[i]);
      for (int i = 0; i < count; ++i) _mm_store_ps(entry(i), _mm_load_ps(&quads[i % 4][i / 4 * 4]));
    }
  }
  // As registers of 8 lanes do it: the first eight now; the others, kept in 32 floats, when those are done with all
  // corners.
  [[gnu::always_inline]] static void add_scattered(const Lanes3<Avx512>& lanes, char* base, const std::uint32_t* offset,
                                                   float* later) {
    const __m512 xy_low = _mm512_unpacklo_ps(lanes.x, lanes.y);
    const __m512 xy_high = _mm512_unpackhi_ps(lanes.x, lanes.y);
    const __m512 z_low = _mm512_unpacklo_ps(lanes.z, all(0));
    const __m512 z_high = _mm512_unpackhi_ps(lanes.z, all(0));
    const __m512 rows[4] = {low_halves(xy_low, z_low), high_halves(xy_low, z_low), low_halves(xy_high, z_high),
                            high_halves(xy_high, z_high)};
    for (int i = 0; i < 4; ++i) add_entry(base + offset[i], _mm512_castps512_ps128(rows[i]));
    for (int i = 0; i < 4; ++i)
      add_entry(base + offset[4 + i], _mm256_extractf128_ps(_mm512_castps512_ps256(rows[i]), 1));
    for (int i = 0; i < 4; ++i) _mm256_store_ps(later + 8 * i, _mm512_extractf32x8_ps(rows[i], 1));
  }
  [[gnu::always_inline]] static void add_later(char* base, const std::uint32_t* offset, const float* later) {
    for (int i = 0; i < 4; ++i) add_entry(base + offset[8 + i], _mm_load_ps(later + 8 * i));
    for (int i = 0; i < 4; ++i) add_entry(base + offset[12 + i], _mm_load_ps(later + 8 * i + 4));
  }
  [[gnu::always_inline]] static void scatter(const Lanes3<Avx512>& lanes, char* base, const std::uint32_t* offset,
                                             int count) {
    scatter4({lanes.x, lanes.y, lanes.z, all(0)}, base, offset, count);
  }
};

}  // namespace
}  // namespace sectio
