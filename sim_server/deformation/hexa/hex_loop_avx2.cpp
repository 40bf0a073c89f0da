#include "sim_server/deformation/hexa/hex_loop.h"
#include "sim_server/deformation/simd_avx2.h"

namespace sectio {

[[gnu::flatten]] float hex_forces_avx2(const HexLoopInput& in) {
  return in.with_bound ? hex_forces<Avx2, true>(in) : hex_forces<Avx2, false>(in);
}

}  // namespace sectio
