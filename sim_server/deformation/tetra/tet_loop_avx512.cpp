#include "sim_server/deformation/simd_avx512.h"
#include "sim_server/deformation/tetra/tet_hessian_loop.h"
#include "sim_server/deformation/tetra/tet_loop.h"

namespace sectio {

constinit const TetLoops tet_loops_avx512 = kTetLoops<Avx512>;
constinit const TetHessianLoops tet_hessian_loops_avx512 = kTetHessianLoops<Avx512>;

}  // namespace sectio
