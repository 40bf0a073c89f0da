// Registers of 8 floats (AVX2) for simd.h. Only *_loop_avx2.cpp include this file.
#pragma once

#include "sim_server/deformation/simd.h"

namespace sectio {
namespace {

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

  static Reg unpack_low(Reg a, Reg b) { return _mm256_unpacklo_ps(a, b); }
  static Reg unpack_high(Reg a, Reg b) { return _mm256_unpackhi_ps(a, b); }
  static Reg low_halves(Reg a, Reg b) {
    return _mm256_castpd_ps(_mm256_unpacklo_pd(_mm256_castps_pd(a), _mm256_castps_pd(b)));
  }
  static Reg high_halves(Reg a, Reg b) {
    return _mm256_castpd_ps(_mm256_unpackhi_pd(_mm256_castps_pd(a), _mm256_castps_pd(b)));
  }

  [[gnu::always_inline]] static Reg load_entries(const char* base, const std::uint32_t* offset) {
    const __m128 low = _mm_load_ps(reinterpret_cast<const float*>(base + offset[0]));
    const __m128 high = _mm_load_ps(reinterpret_cast<const float*>(base + offset[4]));
    return _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
  }
  [[gnu::always_inline]] static void store_entries(const Reg (&rows)[4], char* base, const std::uint32_t* offset,
                                                   int count) {
    const __m128 entries[kWidth] = {_mm256_castps256_ps128(rows[0]),   _mm256_castps256_ps128(rows[1]),
                                    _mm256_castps256_ps128(rows[2]),   _mm256_castps256_ps128(rows[3]),
                                    _mm256_extractf128_ps(rows[0], 1), _mm256_extractf128_ps(rows[1], 1),
                                    _mm256_extractf128_ps(rows[2], 1), _mm256_extractf128_ps(rows[3], 1)};
    if (count == kWidth) {  // a loop of known length
      for (int i = 0; i < kWidth; ++i) _mm_store_ps(reinterpret_cast<float*>(base + offset[i]), entries[i]);
    } else {
      for (int i = 0; i < count; ++i) _mm_store_ps(reinterpret_cast<float*>(base + offset[i]), entries[i]);
    }
  }
  [[gnu::always_inline]] static void add_entries(const Reg (&rows)[4], char* base, const std::uint32_t* offset,
                                                 float* /*later*/) {
    for (int i = 0; i < 4; ++i) add_entry(base + offset[i], _mm256_castps256_ps128(rows[i]));
    for (int i = 0; i < 4; ++i) add_entry(base + offset[4 + i], _mm256_extractf128_ps(rows[i], 1));
  }
  static void add_later(char* /*base*/, const std::uint32_t* /*offset*/, const float* /*later*/) {}
};

}  // namespace
}  // namespace sectio
