#include "sim_server/deformation/hexa/hex_at_rest.h"

#include <array>

#include "sim_server/deformation/hexa/hex_energy.h"

namespace sectio {
namespace {

using Modes = std::array<Vec4f, 8>;

Vec4f vector(float x, float y, float z) {
  return {x, y, z, 0};
}

}  // namespace

HexAtRest::HexAtRest(const HexLattice& lattice, const HexMaterial& material) {
  const double h = lattice.grid.cell_m;
  for (const HexCell& cell : lattice.cells) {
    const double share = cell.fill * cell.stiffness * h / 16;
    cells_.push_back({cell.nodes, cell.offset.cast<float>(), cell.spread.cast<float>(),
                      static_cast<float>(share * material.shear_pa), static_cast<float>(share * material.bulk_pa)});
  }
}

// With M = 4 h 1 and no hourglasses, the Hessian of the energy in hex_kernel.h is isotropic elasticity of the slopes,
// the springs, and a coupling of the hourglasses by the twist term.
void HexAtRest::add_product(std::span<const Vec4f> p_m, std::span<Vec4f> force_n) const {
  constexpr auto kSprings = static_cast<float>(3 * kHourglass), kTwisted = static_cast<float>(kTwist);
  for (const Cell& cell : cells_) {
    Modes p;
    for (std::size_t c = 0; c < 8; ++c) p[c] = p_m[cell.nodes[c]];
    to_modes(p);
    to_centroid(cell.offset, p);
    const float a = cell.shear, x = cell.spread.x(), y = cell.spread.y(), z = cell.spread.z();
    const float swelling = (cell.bulk - a) * (p[1].x() + p[2].y() + p[4].z());
    const float xy = a * (p[1].y() + p[2].x()), yz = a * (p[2].z() + p[4].y()), zx = a * (p[4].x() + p[1].z());
    const float k = kSprings * a, t = kTwisted * a;
    Modes f;
    f[1] = vector(2 * a * p[1].x() + swelling, xy, zx);
    f[2] = vector(xy, 2 * a * p[2].y() + swelling, yz);
    f[4] = vector(zx, yz, 2 * a * p[4].z() + swelling);
    f[3] = k * (x + y) * p[3] - t * vector(y * p[6].z(), x * p[5].z(), -x * p[5].y() - y * p[6].x());
    f[5] = k * (x + z) * p[5] - t * vector(z * p[6].y(), -x * p[3].z() - z * p[6].x(), x * p[3].y());
    f[6] = k * (y + z) * p[6] - t * vector(-y * p[3].z() - z * p[5].y(), z * p[5].x(), y * p[3].x());
    f[7] = k * (x * y + y * z + z * x) * p[7];
    f[0].setZero();
    from_centroid(cell.offset, f);
    from_modes(f);
    for (std::size_t c = 0; c < 8; ++c) force_n[cell.nodes[c]] += f[c];
  }
}

}  // namespace sectio
