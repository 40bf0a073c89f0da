#include "common/mesh/tet_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/math/disjoint_sets.h"
#include "common/mesh/check.h"
#include "common/mesh/slot_table.h"

namespace sectio {
namespace {

struct Face {
  std::array<VertexId, 3> key;  // ascending
  std::uint32_t tet;
  std::uint32_t side;
  bool operator<(const Face& o) const {
    const auto pair = [](std::uint32_t high, std::uint32_t low) { return std::uint64_t{high} << 32 | low; };
    const std::uint64_t first = pair(key[0], key[1]), other = pair(o.key[0], o.key[1]);
    return first != other ? first < other : pair(key[2], tet) < pair(o.key[2], o.tet);
  }
};

std::array<VertexId, 3> corners(const Tetrahedron& t, std::size_t side) {
  return {t[kTetFaces[side][0]], t[kTetFaces[side][1]], t[kTetFaces[side][2]]};
}

std::vector<Face> sorted_faces(const TetMesh& mesh) {
  std::vector<Face> faces;
  faces.reserve(4 * mesh.tetrahedra.size());
  for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t)
    for (std::uint32_t side = 0; side < 4 && mesh.tetrahedra[t] != kNoTetrahedron; ++side) {
      auto key = corners(mesh.tetrahedra[t], side);
      std::sort(key.begin(), key.end());
      faces.push_back({key, t, side});
    }
  std::sort(faces.begin(), faces.end());
  return faces;
}

// +1 if the corners are an even permutation of `key`, -1 if they are an odd one.
int parity(const std::array<VertexId, 3>& corners) {
  return ((corners[0] < corners[1]) == (corners[1] < corners[2])) == (corners[0] < corners[2]) ? 1 : -1;
}

double smallest_dihedral_rad(const std::array<Vec3, 4>& x) {
  std::array<Vec3, 4> normal;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& f = kTetFaces[i];
    normal[i] = (x[f[1]] - x[f[0]]).cross(x[f[2]] - x[f[0]]).normalized();
  }
  double least = M_PI;
  for (const auto& [i, j] : kTetEdges)
    least = std::min(least, std::acos(std::clamp(-normal[i].dot(normal[j]), -1., 1.)));
  return least;
}

class TetCheck {
 public:
  explicit TetCheck(const TetMesh& mesh) : mesh_(mesh) {}

  TetReport run() {
    report_.tetrahedra = static_cast<std::uint32_t>(mesh_.tetrahedra.size());
    report_.smallest_dihedral_deg = report_.tetrahedra > 0 ? 180 : 0;
    if (report_.tetrahedra == 0) defect("no tetrahedra", Vec3::Zero());
    if (check_vertices() && check_corners()) {
      measure();
      check_faces();
      if (report_.valid) check_surface();
    }
    return report_;
  }

 private:
  void defect(const char* what, const Vec3& at) {
    if (!report_.valid) return;
    report_.valid = report_.conforming = false;
    report_.first_defect =
        report_.tetrahedra == 0 ? what : formatted("%s at (%.6g, %.6g, %.6g) m", what, at.x(), at.y(), at.z());
  }
  bool check_vertices() {
    for (const Vec3& x : mesh_.vertices_body_m)
      if (!x.allFinite()) defect("a vertex is not finite", Vec3::Zero());
    return report_.valid;
  }
  bool check_corners() {
    std::vector<std::uint8_t> used(mesh_.vertices_body_m.size(), 0);
    for (const Tetrahedron& t : mesh_.tetrahedra)
      for (const VertexId v : t) {
        if (v >= used.size()) {
          defect("a tetrahedron names a vertex that is not there", Vec3::Zero());
          return false;
        }
        used[v] = 1;
      }
    report_.vertices = static_cast<std::uint32_t>(std::accumulate(used.begin(), used.end(), 0));
    if (report_.vertices < used.size()) {
      const auto unused = static_cast<std::size_t>(std::find(used.begin(), used.end(), 0) - used.begin());
      defect("a vertex of no tetrahedron", mesh_.vertices_body_m[unused]);
    }
    return report_.valid;
  }
  void measure() {
    double least = M_PI;
    for (const Tetrahedron& t : mesh_.tetrahedra) {
      const double volume = tet_volume_m3(mesh_, t);
      if (!(volume > 0)) defect("an inverted or flat tetrahedron", mesh_.vertices_body_m[t[0]]);
      report_.volume_m3 += volume;
      const auto& x = mesh_.vertices_body_m;
      least = std::min(least, smallest_dihedral_rad({x[t[0]], x[t[1]], x[t[2]], x[t[3]]}));
    }
    report_.smallest_dihedral_deg = least * 180 / M_PI;
  }
  void check_faces() {
    const std::vector<Face> faces = sorted_faces(mesh_);
    DisjointSets together(mesh_.tetrahedra.size());
    for (std::size_t n = 0, end = 0; n < faces.size(); n = end) {
      for (end = n + 1; end < faces.size() && faces[end].key == faces[n].key;) ++end;
      const Vec3& at = mesh_.vertices_body_m[faces[n].key[0]];
      if (end - n > 2) defect("a face of more than two tetrahedra", at);
      if (end - n != 2) continue;
      const Face &f = faces[n], &g = faces[n + 1];
      if (parity(corners(mesh_.tetrahedra[f.tet], f.side)) == parity(corners(mesh_.tetrahedra[g.tet], g.side)))
        defect("two tetrahedra on the same side of a face", at);
      together.join(f.tet, g.tet);
    }
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t) report_.components += together.root(t) == t;
  }
  void check_surface() {
    const SurfaceReport surface = sectio::check_soup(surface_of(mesh_).soup);
    if (surface.valid()) return;
    report_.valid = false;
    report_.first_defect = "its surface: " + surface.first_defect;
  }

  const TetMesh& mesh_;
  TetReport report_;
};

}  // namespace

void follow(TetMesh& mesh, const TetChange& change) {
  const std::size_t vertices = change.first_added + change.added_body_m.size();
  if (vertices > mesh.vertices_body_m.size()) resize_slots<Vec3>(mesh.vertices_body_m, vertices, Vec3::Zero());
  std::ranges::copy(change.added_body_m, mesh.vertices_body_m.begin() + change.first_added);
  for (const TetEdit& e : change.tetrahedra) {
    if (e.id >= mesh.tetrahedra.size()) resize_slots(mesh.tetrahedra, e.id + 1, kNoTetrahedron);
    SECTIO_ASSERT(mesh.tetrahedra[e.id] == e.before, "a change follows on what was there");
    mesh.tetrahedra[e.id] = e.after;
  }
}

TetChange between(const TetChange& a, const TetChange& b) {
  TetChange change{b.first_added, b.added_body_m, b.fixed, {}};
  for (auto of_a = a.tetrahedra.begin(), of_b = b.tetrahedra.begin();
       of_a != a.tetrahedra.end() || of_b != b.tetrahedra.end();) {
    if (of_b == b.tetrahedra.end() || (of_a != a.tetrahedra.end() && of_a->id < of_b->id)) {
      change.tetrahedra.push_back({of_a->id, of_a->after, of_a->before, of_a->id});
      ++of_a;
      continue;
    }
    change.tetrahedra.push_back(*of_b);
    if (of_a != a.tetrahedra.end() && of_a->id == of_b->id) change.tetrahedra.back().before = (of_a++)->after;
    ++of_b;
  }
  return change;
}

TetShape tet_shape(const TetMesh& mesh, const Tetrahedron& t) {
  TetShape shape;
  shape.volume_m3 = tet_volume_m3(mesh, t);
  const auto& x = mesh.vertices_body_m;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& [p, q, r] = kTetFaces[i];
    shape.gradient[i] = (x[t[r]] - x[t[p]]).cross(x[t[q]] - x[t[p]]) / (6 * shape.volume_m3);
  }
  return shape;
}

double mean_edge_m(const TetMesh& mesh) {
  double sum = 0;
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const auto& [i, j] : kTetEdges) sum += (mesh.vertices_body_m[t[i]] - mesh.vertices_body_m[t[j]]).norm();
  return sum / (6.0 * static_cast<double>(mesh.tetrahedra.size()));
}

TetSurface surface_of(const TetMesh& mesh) {
  const std::vector<Face> faces = sorted_faces(mesh);
  std::vector<std::uint8_t> outside(4 * mesh.tetrahedra.size(), 0);
  for (std::size_t n = 0, end = 0; n < faces.size(); n = end) {
    for (end = n + 1; end < faces.size() && faces[end].key == faces[n].key;) ++end;
    if (end - n == 1) outside[4 * faces[n].tet + faces[n].side] = 1;
  }
  TetSurface surface;
  std::vector<VertexId> new_id(mesh.vertices_body_m.size(), kNone);
  for (std::size_t h = 0; h < outside.size(); ++h) {
    if (!outside[h]) continue;
    surface.soup.triangles.push_back(corners(mesh.tetrahedra[h / 4], h % 4));
    for (const VertexId v : surface.soup.triangles.back()) new_id[v] = 0;
  }
  for (VertexId v = 0; v < new_id.size(); ++v) {
    if (new_id[v] == kNone) continue;
    new_id[v] = static_cast<VertexId>(surface.of_volume.size());
    surface.of_volume.push_back(v);
    surface.soup.vertices_body_m.push_back(mesh.vertices_body_m[v]);
  }
  for (auto& triangle : surface.soup.triangles)
    for (VertexId& v : triangle) v = new_id[v];
  return surface;
}

TetReport check(const TetMesh& mesh) {
  return TetCheck(mesh).run();
}

}  // namespace sectio
