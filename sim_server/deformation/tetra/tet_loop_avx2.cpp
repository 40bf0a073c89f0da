#include "sim_server/deformation/simd_avx2.h"
#include "sim_server/deformation/tetra/tet_hessian_loop.h"
#include "sim_server/deformation/tetra/tet_loop.h"

namespace sectio {

constinit const TetLoops tet_loops_avx2 = kTetLoops<Avx2>;
constinit const TetHessianLoops tet_hessian_loops_avx2 = kTetHessianLoops<Avx2>;

}  // namespace sectio
