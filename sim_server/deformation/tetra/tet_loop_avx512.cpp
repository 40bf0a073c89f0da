#include "sim_server/deformation/simd_avx512.h"
#include "sim_server/deformation/tetra/tet_hessian_loop.h"
#include "sim_server/deformation/tetra/tet_loop.h"

namespace sectio {

constinit const TetLoops kTetLoopsAvx512 = kTetLoops<Avx512>;
constinit const TetHessianLoops kTetHessianLoopsAvx512 = kTetHessianLoops<Avx512>;

}  // namespace sectio
