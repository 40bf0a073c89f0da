// Registers of 16 floats (AVX-512) for simd.h. Only *_loop_avx512.cpp include this file; these are compiled for AVX-512
// whatever the rest of the program is compiled for, so call them only where has_avx512() holds.
#pragma once

#include "sim_server/deformation/simd.h"

namespace sectio {
namespace {

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

  static Reg unpack_low(Reg a, Reg b) { return _mm512_unpacklo_ps(a, b); }
  static Reg unpack_high(Reg a, Reg b) { return _mm512_unpackhi_ps(a, b); }
  static Reg low_halves(Reg a, Reg b) {
    return _mm512_castpd_ps(_mm512_unpacklo_pd(_mm512_castps_pd(a), _mm512_castps_pd(b)));
  }
  static Reg high_halves(Reg a, Reg b) {
    return _mm512_castpd_ps(_mm512_unpackhi_pd(_mm512_castps_pd(a), _mm512_castps_pd(b)));
  }

  [[gnu::always_inline]] static Reg load_entries(const char* base, const std::uint32_t* offset) {
    const auto at = [&](int i) { return _mm_load_ps(reinterpret_cast<const float*>(base + offset[i])); };
    const __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(at(0)), at(4), 1);
    const __m256 high = _mm256_insertf128_ps(_mm256_castps128_ps256(at(8)), at(12), 1);
    return _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
  }
  [[gnu::always_inline]] static void store_entries(const Reg (&rows)[4], char* base, const std::uint32_t* offset,
                                                   int count) {
    const auto entry = [&](int i) { return reinterpret_cast<float*>(base + offset[i]); };
    if (count == kWidth) [[likely]] {
      for (int i = 0; i < 4; ++i) {  // by halves: storing a quarter of 512 bits takes two cycles on Zen 4
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
  [[gnu::always_inline]] static void add_entries(const Reg (&rows)[4], char* base, const std::uint32_t* offset,
                                                 float* later) {
    for (int i = 0; i < 4; ++i) add_entry(base + offset[i], _mm512_castps512_ps128(rows[i]));
    for (int i = 0; i < 4; ++i)
      add_entry(base + offset[4 + i], _mm256_extractf128_ps(_mm512_castps512_ps256(rows[i]), 1));
    for (int i = 0; i < 4; ++i) _mm256_store_ps(later + 8 * i, _mm512_extractf32x8_ps(rows[i], 1));
  }
  [[gnu::always_inline]] static void add_later(char* base, const std::uint32_t* offset, const float* later) {
    for (int i = 0; i < 4; ++i) add_entry(base + offset[8 + i], _mm_load_ps(later + 8 * i));
    for (int i = 0; i < 4; ++i) add_entry(base + offset[12 + i], _mm_load_ps(later + 8 * i + 4));
  }
};

}  // namespace
}  // namespace sectio
