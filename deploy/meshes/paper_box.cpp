#include "deploy/meshes/paper_box.h"

#include <algorithm>
#include <random>
#include <set>
#include <utility>

#include "common/core/formatted.h"

namespace sectio {
namespace {

using Edge = std::pair<VertexId, VertexId>;

constexpr int kAcross = 4;  // cubes along x and y, one along z
constexpr std::size_t kVertices = 74;
constexpr unsigned kSeed = 17345;  // the first seed that gives 196 tetrahedra and 1167 springs

// Five tetrahedra to a cube, neighbours mirrored: 50 vertices, 80 tetrahedra.
TetMesh lattice() {
  TetMesh mesh;
  const auto id = [](int i, int j, int k) { return static_cast<VertexId>((i * (kAcross + 1) + j) * 2 + k); };
  for (int i = 0; i <= kAcross; ++i)
    for (int j = 0; j <= kAcross; ++j)
      for (int k = 0; k <= 1; ++k) mesh.vertices_body_m.emplace_back(i, j, k);
  constexpr int kFive[5][4] = {{0, 1, 2, 4}, {3, 1, 7, 2}, {5, 1, 4, 7}, {6, 2, 7, 4}, {1, 2, 4, 7}};
  for (int i = 0; i < kAcross; ++i)
    for (int j = 0; j < kAcross; ++j)
      for (const auto& five : kFive) {
        Tetrahedron t;
        for (std::size_t n = 0; n < 4; ++n)
          t[n] = id(i + ((five[n] ^ (i + j)) & 1), j + ((five[n] >> 1) & 1), (five[n] >> 2) & 1);
        if (tet_volume_m3(mesh, t) < 0) std::swap(t[2], t[3]);
        mesh.tetrahedra.push_back(t);
      }
  return mesh;
}

std::vector<Edge> longest_edges(const TetMesh& mesh) {
  std::set<Edge> edges;
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const auto& [i, j] : kTetEdges) edges.insert(std::minmax(t[i], t[j]));
  const auto length = [&](const Edge& e) {
    return (mesh.vertices_body_m[e.first] - mesh.vertices_body_m[e.second]).norm();
  };
  double longest = 0;
  for (const Edge& e : edges) longest = std::max(longest, length(e));
  std::vector<Edge> found;
  std::ranges::copy_if(edges, std::back_inserter(found), [&](const Edge& e) { return length(e) > 0.99 * longest; });
  return found;
}

void bisect(TetMesh& mesh, const Edge& edge) {
  const auto middle = static_cast<VertexId>(mesh.vertices_body_m.size());
  mesh.vertices_body_m.push_back(0.5 * (mesh.vertices_body_m[edge.first] + mesh.vertices_body_m[edge.second]));
  const std::size_t count = mesh.tetrahedra.size();
  for (std::size_t n = 0; n < count; ++n) {
    Tetrahedron other = mesh.tetrahedra[n];
    const auto a = std::ranges::find(other, edge.first), b = std::ranges::find(mesh.tetrahedra[n], edge.second);
    if (a == other.end() || b == mesh.tetrahedra[n].end()) continue;
    *a = *b = middle;
    mesh.tetrahedra.push_back(other);
  }
}

}  // namespace

TetMesh paper_box() {
  TetMesh mesh = lattice();
  std::mt19937 random(kSeed);
  while (mesh.vertices_body_m.size() < kVertices) {
    const std::vector<Edge> longest = longest_edges(mesh);
    bisect(mesh, longest[random() % longest.size()]);
  }
  for (Vec3& x : mesh.vertices_body_m)
    x = Vec3(x.x() / kAcross - 0.5, x.y() / kAcross - 0.5, x.z() - 0.5).cwiseProduct(Vec3(0.08, 0.08, 0.025));
  return mesh;
}

std::string msh(const TetMesh& mesh) {
  std::string text =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(mesh.vertices_body_m.size()) + "\n";
  for (std::size_t v = 0; v < mesh.vertices_body_m.size(); ++v) {
    const Vec3& x = mesh.vertices_body_m[v];
    text += formatted("%zu %.9g %.9g %.9g\n", v + 1, x.x(), x.y(), x.z());
  }
  text += "$EndNodes\n$Elements\n" + std::to_string(mesh.tetrahedra.size()) + "\n";
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) {
    const Tetrahedron& t = mesh.tetrahedra[n];
    text += formatted("%zu 4 2 0 0 %u %u %u %u\n", n + 1, t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
  }
  return text + "$EndElements\n";
}

}  // namespace sectio
