#include "sim_server/deformation/simd_avx512.h"
#include "tests/chart/tet_batch_loop.h"

namespace sectio::chart {

constinit const TetLoops16 tet_loops16_avx512 = kTetLoops16<Avx512>;

}  // namespace sectio::chart
