#include "sim_server/meshing/relax.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/math/intersect.h"

namespace sectio {
namespace {

// A grid of cubes with the triangles whose boxes meet each cube; finds the closest triangle near a point.
class NearTriangles {
 public:
  NearTriangles(const TriangleSoup& surface, double size_m) : surface_(surface), size_m_(size_m) {
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
      Box3 box;
      for (const VertexId v : surface.triangles[t]) box.extend(surface.vertices_body_m[v]);
      const Key low = key(box.min()), high = key(box.max());
      for (int i = low[0]; i <= high[0]; ++i)
        for (int j = low[1]; j <= high[1]; ++j)
          for (int k = low[2]; k <= high[2]; ++k) cubes_[{i, j, k}].push_back(t);
    }
  }

  // The closest point of the surface if a triangle lies within a cube's size of p; p itself if none is near.
  Vec3 closest(const Vec3& p) const {
    const Key at = key(p);
    ClosestPoint best{p, Vec3::Zero(), HUGE_VAL};
    for (int i = at[0] - 1; i <= at[0] + 1; ++i)
      for (int j = at[1] - 1; j <= at[1] + 1; ++j)
        for (int k = at[2] - 1; k <= at[2] + 1; ++k) {
          const auto found = cubes_.find({i, j, k});
          if (found == cubes_.end()) continue;
          for (const std::uint32_t t : found->second) {
            const auto& [a, b, c] = surface_.triangles[t];
            const auto& x = surface_.vertices_body_m;
            const ClosestPoint candidate = closest_on_triangle(p, {x[a], x[b], x[c]});
            if (candidate.squared_distance < best.squared_distance) best = candidate;
          }
        }
    return best.point;
  }

 private:
  using Key = std::array<int, 3>;
  Key key(const Vec3& p) const {
    const Vec3 scaled = p / size_m_;
    return {static_cast<int>(std::floor(scaled.x())), static_cast<int>(std::floor(scaled.y())),
            static_cast<int>(std::floor(scaled.z()))};
  }
  const TriangleSoup& surface_;
  double size_m_;
  std::map<Key, std::vector<std::uint32_t>> cubes_;
};

class Relaxation {
 public:
  Relaxation(TetMesh& mesh, const TriangleSoup& surface, double cell_m)
      : mesh_(mesh), near_(surface, cell_m), boundary_(mesh.vertices_body_m.size(), 0), star_(boundary_.size()) {
    const TetSurface outside = surface_of(mesh);
    for (const VertexId v : outside.of_volume) boundary_[v] = 1;
    for (const auto& t : outside.soup.triangles)
      for (std::size_t i = 0; i < 3; ++i)
        skin_edges_[outside.of_volume[t[i]]].push_back(outside.of_volume[t[(i + 1) % 3]]);
    stiffness_.assign(boundary_.size(), 0);
    volume_.assign(boundary_.size(), 0);
    for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t) {
      for (const VertexId v : mesh.tetrahedra[t]) star_[v].push_back(t);
      add(t, 1);
    }
  }

  void pass() {
    for (VertexId v = 0; v < star_.size(); ++v) improve(v);
  }

 private:
  // Adds (sign 1) or removes (sign -1) a tetrahedron's share of the sums at its corners; returns the largest D that its
  // corners would have if it were alone.
  double add(std::uint32_t t, double sign) {
    const Tetrahedron& corners = mesh_.tetrahedra[t];
    const double volume = tet_volume_m3(mesh_, corners);
    if (!(volume > 0)) return HUGE_VAL;
    double worst = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& x = mesh_.vertices_body_m;
      const Vec3& p = x[corners[kTetFaces[i][0]]];
      const double g2 = (x[corners[kTetFaces[i][1]]] - p).cross(x[corners[kTetFaces[i][2]]] - p).squaredNorm() /
                        (36 * volume * volume);
      stiffness_[corners[i]] += sign * volume * g2;
      volume_[corners[i]] += sign * 0.25 * volume;
      worst = std::max(worst, g2);
    }
    return worst;
  }

  struct Score {
    double nodes = 0, elements = 0;
    bool better_than(const Score& o) const { return nodes < 0.999 * o.nodes && elements <= o.elements; }
  };
  Score score(VertexId v, double elements) const {
    Score s{0, elements};
    for (const std::uint32_t t : star_[v])
      for (const VertexId w : mesh_.tetrahedra[t]) s.nodes = std::max(s.nodes, stiffness_[w] / volume_[w]);
    return s;
  }

  // Moves v and updates the sums; false, with nothing changed, if a tetrahedron would be inverted.
  bool move(VertexId v, const Vec3& to, double& worst_element) {
    const Vec3 from = mesh_.vertices_body_m[v];
    for (const std::uint32_t t : star_[v]) add(t, -1);
    mesh_.vertices_body_m[v] = to;
    const bool valid =
        std::ranges::all_of(star_[v], [&](std::uint32_t t) { return tet_volume_m3(mesh_, mesh_.tetrahedra[t]) > 0; });
    if (!valid) mesh_.vertices_body_m[v] = from;
    worst_element = 0;
    for (const std::uint32_t t : star_[v]) worst_element = std::max(worst_element, add(t, 1));
    return valid;
  }

  Vec3 middle_of_neighbours(VertexId v) const {
    Vec3 sum = Vec3::Zero();
    double count = 0;
    if (boundary_[v]) {
      for (const VertexId w : skin_edges_.at(v)) sum += mesh_.vertices_body_m[w], ++count;
      return sum / count;
    }
    for (const std::uint32_t t : star_[v])
      for (const VertexId w : mesh_.tetrahedra[t])
        if (w != v) sum += mesh_.vertices_body_m[w], ++count;
    return sum / count;
  }

  void improve(VertexId v) {
    const Vec3 start = mesh_.vertices_body_m[v], middle = middle_of_neighbours(v);
    double elements = 0;
    move(v, start, elements);
    const Score before = score(v, elements);
    for (const double way : {1.0, 0.5, 0.25}) {
      Vec3 to = start + way * (middle - start);
      if (boundary_[v]) to = near_.closest(to);
      if (move(v, to, elements) && score(v, elements).better_than(before)) return;
      move(v, start, elements);
    }
  }

  TetMesh& mesh_;
  NearTriangles near_;
  std::vector<std::uint8_t> boundary_;
  std::vector<std::vector<std::uint32_t>> star_;
  std::map<VertexId, std::vector<VertexId>> skin_edges_;
  std::vector<double> stiffness_, volume_;  // sums over the star
};

}  // namespace

void relax(TetMesh& mesh, const TriangleSoup& surface, double cell_m, int passes) {
  Relaxation relaxation(mesh, surface, cell_m);
  for (int n = 0; n < passes; ++n) relaxation.pass();
}

}  // namespace sectio
