// Tetrahedra in batches of sixteen for the loops of the methods that the simulator does not have. The loops use the
// simulator's own registers (sim_server/deformation/simd.h), in both widths, so that speeds compare methods.
#pragma once

#include <cstddef>
#include <cstdint>

namespace sectio::chart {

constexpr int kBatch = 16;

// Entries of particles are four floats; offsets are in bytes. Lanes without a tetrahedron have no volume.
struct TetBatch {
  alignas(64) std::uint32_t offset[4][kBatch];
  float gradient[3][3][kBatch];  // corners 1 to 3, 1/m; that of corner 0 is minus their sum
  float volume_m3[kBatch];
};

struct XpbdBatch : TetBatch {
  float compliance[2][kBatch];  // shape and volume, 1 / (stiffness volume)
  float multiplier[2][kBatch];
};

struct CorotatedBatch : TetBatch {
  float rotation[4][kBatch];    // a quaternion, kept from step to step
  float rotated[3][3][kBatch];  // the gradients
};

struct TetMaterial {
  float lambda_pa = 0, mu_pa = 0;
};

struct TetLoops16 {
  // Adds the forces of the stable neo-Hookean solid.
  void (*neo_hookean)(const TetBatch*, std::size_t count, const TetMaterial&, const char* position, char* force);
  // Solves both constraints of each tetrahedron; no two of a batch share a particle. The fourth float of a position is
  // the inverse mass.
  void (*solve_constraints)(XpbdBatch*, std::size_t count, const TetMaterial&, float step_s, char* position);
  // Finds rotations from those that the batches have, and adds the elastic forces. `diagonal`: adds the blocks of the
  // stiffness on the diagonal, xx yy zz and xy yz zx.
  void (*corotate)(CorotatedBatch*, std::size_t count, const TetMaterial&, int iterations, const char* position,
                   char* force, char* const* diagonal);
  // Adds the product of the stiffness, in the rotations found last, and a vector.
  void (*multiply)(const CorotatedBatch*, std::size_t count, const TetMaterial&, const char* in, char* out);
};
extern const TetLoops16 tet_loops16_avx2, tet_loops16_avx512;

}  // namespace sectio::chart
