// The width of the registers that the kernels use. It changes speed only: every width computes the same bits.
#pragma once

namespace sectio {

enum class SimdWidth { widest, eight, sixteen };  // sixteen lanes need has_avx512()
bool has_avx512();
inline bool has_sixteen_lanes(SimdWidth width) {
  return width == SimdWidth::sixteen || (width == SimdWidth::widest && has_avx512());
}

}  // namespace sectio
