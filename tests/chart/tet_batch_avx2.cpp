#include "sim_server/deformation/simd_avx2.h"
#include "tests/chart/tet_batch_loop.h"

namespace sectio::chart {

constinit const TetLoops16 tet_loops16_avx2 = kTetLoops16<Avx2>;

}  // namespace sectio::chart
