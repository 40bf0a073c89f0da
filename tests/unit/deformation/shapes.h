// Meshes and bodies for the tests of this room.
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "sim_server/deformation/surface_springs.h"

namespace sectio::test {

// An icosahedron, each triangle split in four `levels` times, on an ellipsoid with these half-axes.
inline TriangleSoup ellipsoid(const Vec3& half_axes_m, int levels) {
  const double g = 0.5 * (1 + std::sqrt(5.0));
  TriangleSoup soup;
  soup.vertices_body_m = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                          {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  soup.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<VertexId, VertexId>, VertexId> middles;
    const auto middle = [&](VertexId a, VertexId b) {
      const auto [at, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<VertexId>(soup.vertices_body_m.size()));
      if (is_new) soup.vertices_body_m.push_back(0.5 * (soup.vertices_body_m[a] + soup.vertices_body_m[b]));
      return at->second;
    };
    std::vector<std::array<VertexId, 3>> finer;
    for (const auto& [a, b, c] : soup.triangles) {
      const VertexId ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    soup.triangles = finer;
    for (Vec3& v : soup.vertices_body_m) v.normalize();
  }
  for (Vec3& v : soup.vertices_body_m) v = v.normalized().cwiseProduct(half_axes_m);
  return soup;
}

// A liver-sized body: 642 vertices, 1280 triangles, edges of about 6 mm.
inline TriangleMesh organ(int levels = 3) {
  return TriangleMesh(ellipsoid({0.06, 0.045, 0.035}, levels));
}

// Slots that a test may edit freely. mesh() checks nothing; the edits below keep the surface closed.
class MeshEditor {
 public:
  explicit MeshEditor(const TriangleMesh& mesh)
      : rest_(mesh.rest_body_m().begin(), mesh.rest_body_m().end()),
        alive_(mesh.vertex_slots(), 1),
        triangles_(mesh.triangles().begin(), mesh.triangles().end()) {}

  TriangleMesh mesh() const { return TriangleMesh(rest_, alive_, triangles_, 0); }

  // Puts a vertex on the edge v[i] -> v[i + 1] of triangle t, at s of its length; returns the vertices touched.
  std::vector<VertexId> split_edge(const TriangleMesh& now, TriangleId t, int i, double s) {
    const TriangleId u = now.neighbour(t, i);
    const auto corner = [](int n) { return static_cast<std::size_t>(n % 3); };
    const Triangle first = triangles_[t], second = triangles_[u];
    const VertexId a = first.v[corner(i)], b = first.v[corner(i + 1)], c = first.v[corner(i + 2)];
    const VertexId d = second.v[corner(second.corner_of(a) + 1)];
    const VertexId m = new_vertex((1 - s) * rest_[a] + s * rest_[b]);
    triangles_[t] = {{a, m, c}, first.surface};
    const TriangleId t2 = new_triangle({{m, b, c}, first.surface});
    triangles_[u] = {{a, d, m}, second.surface};
    const TriangleId u2 = new_triangle({{m, d, b}, second.surface});
    history_.push_back({t, u, t2, u2, first, second, m});
    return {a, b, c, d, m};
  }

  // Undoes the last split; its slots stay, dead, for the next one.
  std::vector<VertexId> undo() {
    const Split last = history_.back();
    history_.pop_back();
    triangles_[last.t] = last.first;
    triangles_[last.u] = last.second;
    for (const TriangleId dead : {last.t2, last.u2}) {
      triangles_[dead] = {};
      free_triangles_.push_back(dead);
    }
    alive_[last.middle] = 0;
    free_vertices_.push_back(last.middle);
    std::vector<VertexId> touched{last.middle};
    touched.insert(touched.end(), last.first.v.begin(), last.first.v.end());
    for (const VertexId v : last.second.v) {
      if (last.first.corner_of(v) < 0) touched.push_back(v);
    }
    return touched;
  }
  bool can_undo() const { return !history_.empty(); }

  void set_surface(TriangleId t, Surface surface) { triangles_[t].surface = surface; }

 private:
  struct Split {
    TriangleId t, u, t2, u2;
    Triangle first, second;
    VertexId middle;
  };

  VertexId new_vertex(const Vec3& at) {
    if (free_vertices_.empty()) {
      free_vertices_.push_back(static_cast<VertexId>(rest_.size()));
      rest_.emplace_back();
      alive_.emplace_back();
    }
    const VertexId v = free_vertices_.back();
    free_vertices_.pop_back();
    rest_[v] = at;
    alive_[v] = 1;
    return v;
  }
  TriangleId new_triangle(const Triangle& triangle) {
    if (free_triangles_.empty()) {
      free_triangles_.push_back(static_cast<TriangleId>(triangles_.size()));
      triangles_.emplace_back();
    }
    const TriangleId t = free_triangles_.back();
    free_triangles_.pop_back();
    triangles_[t] = triangle;
    return t;
  }

  std::vector<Vec3> rest_;
  std::vector<std::uint8_t> alive_;
  std::vector<Triangle> triangles_;
  std::vector<VertexId> free_vertices_;
  std::vector<TriangleId> free_triangles_;
  std::vector<Split> history_;
};

// Positions and velocities of a body at rest at its pose.
struct Particles {
  std::vector<Vec4f> x, v;

  Particles(const TriangleMesh& mesh, const Pose& pose) { grow(mesh, pose); }
  void grow(const TriangleMesh& mesh, const Pose& pose = {}) {
    for (VertexId i = static_cast<VertexId>(x.size()); i < mesh.vertex_slots(); ++i) {
      x.push_back(Vec4f::Zero());
      x.back().head<3>() = pose.to_world(mesh.rest_body_m(i)).cast<float>();
      v.push_back(Vec4f::Zero());
    }
  }
  Vec3 at(VertexId i) const { return x[i].head<3>().cast<double>(); }
  void run(SurfaceSprings& springs, int steps) {
    for (int n = 0; n < steps; ++n) springs.step(x, v);
  }
  double speed() const {
    double greatest = 0;
    for (const Vec4f& u : v) greatest = std::max(greatest, static_cast<double>(u.head<3>().norm()));
    return greatest;
  }
};

inline double volume_m3(const TriangleMesh& mesh, const Particles& p) {
  double six_volumes = 0;
  for (const Triangle& t : mesh.triangles()) {
    if (t.alive()) six_volumes += p.at(t.v[0]).dot(p.at(t.v[1]).cross(p.at(t.v[2])));
  }
  return six_volumes / 6;
}

inline SurfaceSpringSettings no_gravity(double step_s = 0.001) {
  return {step_s, Vec3::Zero(), {}};
}

}  // namespace sectio::test
