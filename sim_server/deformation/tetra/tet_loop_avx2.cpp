#include "sim_server/deformation/simd_avx2.h"
#include "sim_server/deformation/tetra/tet_hessian_loop.h"
#include "sim_server/deformation/tetra/tet_loop.h"

namespace sectio {

constinit const TetLoops kTetLoopsAvx2 = kTetLoops<Avx2>;
constinit const TetHessianLoops kTetHessianLoopsAvx2 = kTetHessianLoops<Avx2>;

}  // namespace sectio
