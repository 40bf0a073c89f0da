#include "tests/support/tet_shapes.h"

#include <cstdint>
#include <utility>

namespace sectio::test {

TetMesh tet_box(int nx, int ny, int nz, const Vec3& size_m, BoxLattice lattice) {
  TetMesh mesh;
  const auto id = [&](int i, int j, int k) { return static_cast<VertexId>((i * (ny + 1) + j) * (nz + 1) + k); };
  for (int i = 0; i <= nx; ++i)
    for (int j = 0; j <= ny; ++j)
      for (int k = 0; k <= nz; ++k)
        mesh.vertices_body_m.push_back(Vec3(double(i) / nx, double(j) / ny, double(k) / nz).cwiseProduct(size_m));
  constexpr int kFive[5][4] = {{0, 1, 2, 4}, {3, 1, 7, 2}, {5, 1, 4, 7}, {6, 2, 7, 4}, {1, 2, 4, 7}};
  constexpr int kKuhn[6][2] = {{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}};  // 0, these, 7
  for (int i = 0; i < nx; ++i)
    for (int j = 0; j < ny; ++j)
      for (int k = 0; k < nz; ++k) {
        const bool mirrored = lattice == BoxLattice::five && (i + j + k) % 2 == 1;
        const auto corner = [&](int c) {
          const int x = (c & 1) ^ (mirrored ? 1 : 0);
          return id(i + x, j + ((c >> 1) & 1), k + ((c >> 2) & 1));
        };
        const auto add = [&](int a, int b, int c, int d) {
          Tetrahedron t{corner(a), corner(b), corner(c), corner(d)};
          if (tet_volume_m3(mesh, t) < 0) std::swap(t[2], t[3]);
          mesh.tetrahedra.push_back(t);
        };
        if (lattice == BoxLattice::five)
          for (const auto& t : kFive) add(t[0], t[1], t[2], t[3]);
        else
          for (const auto& t : kKuhn) add(0, t[0], t[1], 7);
      }
  return mesh;
}

void jitter(TetMesh& mesh, double by_m) {
  std::uint64_t state = 12345;
  const auto next = [&] {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state >> 40) / (1 << 23) - 1;
  };
  for (Vec3& x : mesh.vertices_body_m) x += by_m * Vec3(next(), next(), next());
}

Points at_rest(const TetMesh& mesh) {
  Points x(mesh.vertices_body_m.size(), Vec4f::Zero());
  for (std::size_t i = 0; i < x.size(); ++i) x[i].head<3>() = mesh.vertices_body_m[i].cast<float>();
  return x;
}

Points still(const Points& x) {
  return Points(x.size(), Vec4f::Zero());
}

}  // namespace sectio::test
