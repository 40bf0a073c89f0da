#include "sim_server/deformation/hexa/hex_loop.h"
#include "sim_server/deformation/simd_avx512.h"

namespace sectio {

[[gnu::flatten]] float hex_forces_avx512(const HexLoopInput& in) {
  return in.with_bound ? hex_forces<Avx512, true>(in) : hex_forces<Avx512, false>(in);
}

}  // namespace sectio
