#include "sim_server/deformation/lanes_avx512.h"
#include "sim_server/deformation/tetra/tet_loop.h"

namespace sectio {

[[gnu::flatten]] float tet_pressures_avx512(const TetLoopInput& in) {
  return in.with_bound ? tet_pressures<Avx512, true>(in) : tet_pressures<Avx512, false>(in);
}

[[gnu::flatten]] VelocityOutcome tet_velocities_avx512(const TetLoopInput& in) {
  return tet_velocities<Avx512>(in);
}

[[gnu::flatten]] float tet_descent_avx512(const TetLoopInput& in) {
  return tet_descent<Avx512>(in);
}

}  // namespace sectio
