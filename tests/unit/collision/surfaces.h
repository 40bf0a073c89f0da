// Closed surfaces for collision tests, and the test of every triangle as a reference.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

#include "common/delta/topology_delta.h"
#include "sim_server/collision/front_tracker.h"
#include "sim_server/collision/surface_tree.h"
#include "tests/support/random.h"

namespace sectio::collision_test {

using Random = test::Random64;

inline double uniform(Random& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}
inline Vec3 uniform_vec(Random& random, double low, double high) {
  const double x = uniform(random, low, high), y = uniform(random, low, high), z = uniform(random, low, high);
  return {x, y, z};
}
inline std::size_t below(Random& random, std::size_t n) {
  return static_cast<std::size_t>(random() % n);
}

// A mesh with its current positions and its tree.
struct SurfaceBody {
  TriangleMesh mesh;
  std::vector<Vec3f> x;

  explicit SurfaceBody(const TriangleSoup& soup) : mesh(soup) {
    for (const Vec3& p : mesh.rest_body_m()) x.push_back(p.cast<float>());
  }
  SurfaceView view() const { return {mesh, x, 7}; }
};

// Welds the corners of triangles that are exactly equal.
inline TriangleSoup weld(const std::vector<Corners>& triangles) {
  TriangleSoup soup;
  std::map<std::array<double, 3>, VertexId> ids;
  for (const Corners& t : triangles) {
    std::array<VertexId, 3> v{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [it, fresh] =
          ids.try_emplace({t[i].x(), t[i].y(), t[i].z()}, static_cast<VertexId>(soup.vertices_body_m.size()));
      if (fresh) soup.vertices_body_m.push_back(t[i]);
      v[i] = it->second;
    }
    soup.triangles.push_back(v);
  }
  return soup;
}

// An octahedron whose faces are divided n times: 8 n^2 triangles, radius 5 cm, with bumps.
inline TriangleSoup organ(int n, double bump = 0.15) {
  std::vector<Corners> triangles;
  for (int face = 0; face < 8; ++face) {
    const double sx = (face & 1) ? -1 : 1, sy = (face & 2) ? -1 : 1, sz = (face & 4) ? -1 : 1;
    const auto at = [&](int i, int j) -> Vec3 {
      const Vec3 u = Vec3(sx * (n - i - j), sy * i, sz * j).normalized();
      return 0.05 * u * (1 + bump * std::sin(5 * u.x()) * std::sin(4 * u.y() + 3 * u.z()));
    };
    const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
      triangles.push_back(sx * sy * sz < 0 ? Corners{a, c, b} : Corners{a, b, c});
    };
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        add(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 1 < n) add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
  }
  return weld(triangles);
}

// A box of cells from `low` to `high`, each side divided in squares of two triangles.
inline void add_box(std::vector<Corners>& triangles, const Vec3& low, const Vec3& high,
                    const std::array<int, 3>& cells) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const bool upper : {false, true}) {
      const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
      const auto at = [&](int i, int j) {
        Vec3 p;
        p[static_cast<Eigen::Index>(axis)] =
            upper ? high[static_cast<Eigen::Index>(axis)] : low[static_cast<Eigen::Index>(axis)];
        const auto ui = static_cast<Eigen::Index>(u), vi = static_cast<Eigen::Index>(v);
        p[ui] = i == cells[u] ? high[ui] : low[ui] + (high[ui] - low[ui]) * i / cells[u];
        p[vi] = j == cells[v] ? high[vi] : low[vi] + (high[vi] - low[vi]) * j / cells[v];
        return p;
      };
      const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
        triangles.push_back(upper ? Corners{a, b, c} : Corners{a, c, b});
      };
      for (int i = 0; i < cells[u]; ++i)
        for (int j = 0; j < cells[v]; ++j) {
          add(at(i, j), at(i + 1, j), at(i + 1, j + 1));
          add(at(i, j), at(i + 1, j + 1), at(i, j + 1));
        }
    }
}

inline std::vector<TriangleId> every_triangle(const TriangleMesh& mesh) {
  std::vector<TriangleId> all;
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t)
    if (mesh.triangle(t).alive()) all.push_back(t);
  return all;
}

inline std::vector<SurfaceHit> every_hit(const SurfaceView& view, const Vec3& p, const Vec3& q) {
  std::vector<SurfaceHit> found;
  for (const TriangleId t : every_triangle(view.mesh))
    if (auto hit = hit_triangle(view, t, p, q)) found.push_back(*hit);
  sort_hits(found);
  return found;
}

inline ToolContact every_contact(const SurfaceView& view, const FrontStep& step) {
  ToolContact contact;
  const auto &from = step.before.at_world_m, &to = step.after.at_world_m;
  const auto all = every_triangle(view.mesh);
  for (std::size_t s = 0; s < kToolSegments; ++s) {
    const auto [i, j] = kSegmentCorners[s];
    contact.segments[s] = {every_hit(view, from[i], from[j]), every_hit(view, to[i], to[j]),
                           cross_edges(view, all, {from[i], from[j], to[i], to[j]})};
  }
  for (std::size_t i = 0; i < 4; ++i) contact.corner_paths[i] = every_hit(view, from[i], to[i]);
  return contact;
}

inline bool same(const std::vector<SurfaceHit>& x, const std::vector<SurfaceHit>& y) {
  return std::equal(x.begin(), x.end(), y.begin(), y.end(), [](const SurfaceHit& a, const SurfaceHit& b) {
    return a.body == b.body && a.triangle == b.triangle && a.parameter == b.parameter && a.entering == b.entering &&
           a.point_world_m == b.point_world_m;
  });
}
inline bool same(const std::vector<EdgeCrossing>& x, const std::vector<EdgeCrossing>& y) {
  return std::equal(x.begin(), x.end(), y.begin(), y.end(), [](const EdgeCrossing& a, const EdgeCrossing& b) {
    return a.triangle == b.triangle && a.edge == b.edge && a.time == b.time && a.point_world_m == b.point_world_m;
  });
}
inline bool same(const ToolContact& x, const ToolContact& y) {
  for (std::size_t s = 0; s < kToolSegments; ++s)
    if (!same(x.segments[s].before, y.segments[s].before) || !same(x.segments[s].after, y.segments[s].after) ||
        !same(x.segments[s].swept, y.segments[s].swept))
      return false;
  for (std::size_t i = 0; i < 4; ++i)
    if (!same(x.corner_paths[i], y.corner_paths[i])) return false;
  return true;
}

inline std::vector<TriangleId> slots_of(const TopologyDelta& delta) {
  std::vector<TriangleId> slots;
  for (const TriangleEdit& edit : delta.triangles) slots.push_back(edit.id);
  return slots;
}

// Puts a new vertex into a triangle: one triangle changes, two are added, in freed slots first.
inline TopologyDelta split(const TriangleMesh& mesh, TriangleId t, const Vec3& rest_body_m) {
  TopologyDelta delta;
  delta.base_revision = mesh.revision();
  delta.revision = delta.base_revision + 1;
  const VertexId v = mesh.free_vertices().empty() ? mesh.vertex_slots() : mesh.free_vertices()[0];
  std::vector<TriangleId> ids{t};
  for (const TriangleId id : mesh.free_triangles())
    if (ids.size() < 3) ids.push_back(id);
  for (TriangleId id = mesh.triangle_slots(); ids.size() < 3; ++id) ids.push_back(id);
  const auto c = mesh.triangle(t).v;
  delta.vertices.push_back({v, true, rest_body_m});
  for (std::size_t i = 0; i < 3; ++i) delta.triangles.push_back({ids[i], {{c[i], c[(i + 1) % 3], v}, Surface::skin}});
  std::sort(delta.triangles.begin(), delta.triangles.end(), [](auto& a, auto& b) { return a.id < b.id; });
  delta.vertex_slots_after = std::max(mesh.vertex_slots(), v + 1);
  delta.triangle_slots_after = std::max(mesh.triangle_slots(), delta.triangles.back().id + 1);
  std::uint64_t hash = mesh.hash() - slots_hash(mesh.vertex_slots(), mesh.triangle_slots()) +
                       slots_hash(delta.vertex_slots_after, delta.triangle_slots_after) + vertex_hash(v, rest_body_m);
  hash -= triangle_hash(t, mesh.triangle(t));
  for (const TriangleEdit& edit : delta.triangles) hash += triangle_hash(edit.id, edit.triangle);
  delta.hash_after = hash;
  return delta;
}

// Removes a vertex of three triangles again: one of them is left.
inline TopologyDelta unsplit(const TriangleMesh& mesh, VertexId v) {
  TopologyDelta delta;
  delta.base_revision = mesh.revision();
  delta.revision = delta.base_revision + 1;
  const TriangleId t0 = mesh.incident(v);
  const int i = mesh.triangle(t0).corner_of(v);
  const TriangleId t1 = mesh.neighbour(t0, i), t2 = mesh.neighbour(t0, (i + 2) % 3);
  const auto corner = [&](TriangleId t, int k) {
    return mesh.triangle(t).v[static_cast<std::size_t>((mesh.triangle(t).corner_of(v) + k) % 3)];
  };
  // t1 lies before t0's edge v -> b, t2 behind v -> c.
  const VertexId b = corner(t0, 1), c = corner(t0, 2), d = corner(t1, 1);
  delta.vertices.push_back({v, false, mesh.rest_body_m(v)});
  delta.triangles.push_back({t0, {{b, c, d}, Surface::skin}});
  delta.triangles.push_back({t1, {}});
  delta.triangles.push_back({t2, {}});
  std::sort(delta.triangles.begin(), delta.triangles.end(), [](auto& a, auto& z) { return a.id < z.id; });
  delta.vertex_slots_after = mesh.vertex_slots();
  delta.triangle_slots_after = mesh.triangle_slots();
  std::uint64_t hash = mesh.hash() - vertex_hash(v, mesh.rest_body_m(v));
  for (const TriangleId t : {t0, t1, t2}) hash -= triangle_hash(t, mesh.triangle(t));
  delta.hash_after = hash + triangle_hash(t0, {{b, c, d}, Surface::skin});
  return delta;
}

}  // namespace sectio::collision_test
