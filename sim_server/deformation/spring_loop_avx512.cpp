#include "sim_server/deformation/simd_avx512.h"
#include "sim_server/deformation/spring_loop.h"

namespace sectio {

[[gnu::flatten]] VelocityOutcome spring_loop_avx512(const SpringLoopInput& in) {
  return in.velocity_before ? spring_loop<Avx512, true>(in) : spring_loop<Avx512, false>(in);
}

}  // namespace sectio
