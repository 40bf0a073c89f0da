#include "sim_server/deformation/lanes_avx2.h"
#include "sim_server/deformation/tetra/tet_loop.h"

namespace sectio {

[[gnu::flatten]] float tet_pressures_avx2(const TetLoopInput& in) {
  return in.with_bound ? tet_pressures<Avx2, true>(in) : tet_pressures<Avx2, false>(in);
}

[[gnu::flatten]] VelocityOutcome tet_velocities_avx2(const TetLoopInput& in) {
  return tet_velocities<Avx2>(in);
}

[[gnu::flatten]] float tet_descent_avx2(const TetLoopInput& in) {
  return tet_descent<Avx2>(in);
}

}  // namespace sectio
