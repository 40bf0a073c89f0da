#include "sim_server/deformation/simd_avx2.h"
#include "sim_server/deformation/spring_loop.h"

namespace sectio {

[[gnu::flatten]] VelocityOutcome spring_loop_avx2(const SpringLoopInput& in) {
  return in.velocity_before ? spring_loop<Avx2, true>(in) : spring_loop<Avx2, false>(in);
}

}  // namespace sectio
