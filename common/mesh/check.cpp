#include "common/mesh/check.h"

#include <algorithm>

#include "common/core/formatted.h"
#include "common/math/disjoint_sets.h"
#include "common/mesh/enclosed_volume.h"

namespace sectio {
namespace {

// Half-edge 3 t + i runs from corner i to corner i + 1 of triangle t.
constexpr std::uint32_t next_corner(std::uint32_t h) {
  return h % 3 == 2 ? h - 2 : h + 1;
}
constexpr std::uint32_t previous_corner(std::uint32_t h) {
  return h % 3 == 0 ? h + 2 : h - 1;
}

class SurfaceCheck {
 public:
  // corners: three a triangle. A triangle that starts with kNone is a dead slot if dead_slots, else a defect.
  SurfaceCheck(std::vector<VertexId> corners, std::span<const Vec3> positions_m, bool dead_slots)
      : corner_(std::move(corners)), position_(positions_m), dead_slots_(dead_slots) {}

  // alive(v): whether vertex v is part of the surface.
  template <class Alive>
  SurfaceReport run(Alive alive) {
    check_positions(alive);
    if (!check_corners(alive)) return report_;
    collect_edges();
    pair_edges();
    check_fans(alive);
    count_components();
    report_.euler_characteristic = static_cast<std::int64_t>(report_.vertices) - edges_ + report_.triangles;
    if (report_.finite) report_.volume_m3 = volume_m3();
    return report_;
  }

  // The opposite of each half-edge, kNone where there is none or several; empty when run() stopped early.
  std::span<const std::uint32_t> twins() const { return twin_; }

  void add_defect(bool SurfaceReport::*flag, const std::string& text) {
    report_.*flag = false;
    ++report_.defects;
    if (report_.first_defect.empty()) report_.first_defect = text;
  }
  const SurfaceReport& report() const { return report_; }

 private:
  std::uint32_t half_edges() const { return static_cast<std::uint32_t>(corner_.size()); }
  std::uint32_t triangles() const { return half_edges() / 3; }
  bool dead(std::uint32_t triangle) const { return dead_slots_ && corner_[3 * std::size_t{triangle}] == kNone; }
  VertexId from(std::uint32_t h) const { return corner_[h]; }
  VertexId to(std::uint32_t h) const { return corner_[next_corner(h)]; }
  VertexId lower(std::uint32_t h) const { return std::min(from(h), to(h)); }
  VertexId upper(std::uint32_t h) const { return std::max(from(h), to(h)); }
  bool same_edge(std::uint32_t g, std::uint32_t h) const { return lower(g) == lower(h) && upper(g) == upper(h); }

  std::string at(const Vec3& p) const { return formatted("(%.6g, %.6g, %.6g) m", p.x(), p.y(), p.z()); }
  std::string edge_text(std::uint32_t h) const {
    const VertexId a = lower(h), b = upper(h);
    return "edge " + std::to_string(a) + "-" + std::to_string(b) + " at " + at(0.5 * (position_[a] + position_[b]));
  }

  template <class Alive>
  void check_positions(Alive alive) {
    for (VertexId v = 0; v < position_.size(); ++v) {
      if (!alive(v)) continue;
      ++report_.vertices;
      if (!position_[v].allFinite())
        add_defect(&SurfaceReport::finite, "vertex " + std::to_string(v) + " is not finite");
    }
  }

  // False when a corner names no vertex; no other check is possible then.
  template <class Alive>
  bool check_corners(Alive alive) {
    bool usable = true;
    for (std::uint32_t t = 0; t < triangles(); ++t) {
      if (dead(t)) continue;
      ++report_.triangles;
      const VertexId* v = &corner_[3 * std::size_t{t}];
      const bool known = std::all_of(v, v + 3, [&](VertexId x) { return x < position_.size() && alive(x); });
      if (!known)
        add_defect(&SurfaceReport::manifold, "triangle " + std::to_string(t) + " names a vertex that is not there");
      usable = usable && known;
      if (known && (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])) {
        add_defect(&SurfaceReport::manifold,
                   "triangle " + std::to_string(t) + " at " + at(position_[v[0]]) + " has the same vertex twice");
      }
    }
    if (report_.triangles == 0) add_defect(&SurfaceReport::closed, "there is no triangle");
    return usable && report_.triangles > 0;
  }

  // Half-edges in buckets of their lower vertex, each bucket sorted by the upper vertex.
  void collect_edges() {
    bucket_.assign(position_.size() + 1, 0);
    for (std::uint32_t h = 0; h < half_edges(); ++h) {
      if (!dead(h / 3)) ++bucket_[lower(h) + 1];
    }
    std::partial_sum(bucket_.begin(), bucket_.end(), bucket_.begin());
    sorted_.resize(bucket_.back());
    std::vector<std::uint32_t> cursor(bucket_.begin(), bucket_.end() - 1);
    for (std::uint32_t h = 0; h < half_edges(); ++h) {
      if (!dead(h / 3)) sorted_[cursor[lower(h)]++] = h;
    }
    for (std::size_t v = 0; v + 1 < bucket_.size(); ++v) {
      std::sort(sorted_.begin() + bucket_[v], sorted_.begin() + bucket_[v + 1],
                [&](std::uint32_t a, std::uint32_t b) { return upper(a) != upper(b) ? upper(a) < upper(b) : a < b; });
    }
  }

  void pair_edges() {
    twin_.assign(half_edges(), kNone);
    for (std::size_t begin = 0, end = 0; begin < sorted_.size(); begin = end) {
      const std::uint32_t h = sorted_[begin];
      std::uint32_t along = 0, against = 0;
      for (end = begin; end < sorted_.size() && same_edge(h, sorted_[end]); ++end) {
        ++(from(sorted_[end]) == lower(h) ? along : against);
      }
      ++edges_;
      if (along == 1 && against == 1) {
        twin_[h] = sorted_[begin + 1];
        twin_[sorted_[begin + 1]] = h;
        continue;
      }
      const std::string triangle = " (triangle " + std::to_string(h / 3) + ")";
      if (along + against == 1) {
        add_defect(&SurfaceReport::closed, edge_text(h) + " has a triangle on one side only" + triangle);
        continue;
      }
      if (along == 0 || against == 0) report_.closed = false;
      add_defect(&SurfaceReport::manifold,
                 along + against == 2
                     ? edge_text(h) + " joins two triangles of opposite orientation" + triangle
                     : edge_text(h) + " joins " + std::to_string(along + against) + " triangles" + triangle);
    }
  }

  // Checks that the triangles around a vertex form one ring: a walk from any corner meets all of them.
  template <class Alive>
  void check_fans(Alive alive) {
    std::vector<std::uint32_t> degree(position_.size(), 0), start(position_.size(), kNone);
    for (std::uint32_t h = half_edges(); h-- > 0;) {
      if (dead(h / 3)) continue;
      ++degree[from(h)];
      start[from(h)] = h;
    }
    for (VertexId v = 0; v < position_.size(); ++v) {
      if (!alive(v)) continue;
      if (degree[v] == 0) {
        add_defect(&SurfaceReport::manifold,
                   "vertex " + std::to_string(v) + " at " + at(position_[v]) + " has no triangle");
        continue;
      }
      std::uint32_t h = start[v], length = 0;
      do {
        h = twin_[previous_corner(h)];
        ++length;
      } while (h != kNone && h != start[v] && length <= degree[v]);
      if (h == kNone) continue;  // the walk ended at an edge that has been reported already
      if (length != degree[v]) {
        add_defect(&SurfaceReport::manifold, "vertex " + std::to_string(v) + " at " + at(position_[v]) +
                                                 " joins sheets that share no edge there (" +
                                                 std::to_string(degree[v]) + " triangles, " + std::to_string(length) +
                                                 " in the first)");
      } else if (length < 3) {
        add_defect(&SurfaceReport::manifold,
                   "vertex " + std::to_string(v) + " at " + at(position_[v]) + " has fewer than three triangles");
      }
    }
  }

  // Triangles that share an edge, valid or not, are in one component.
  void count_components() {
    DisjointSets together(triangles());
    report_.components = report_.triangles;
    for (std::size_t i = 0; i + 1 < sorted_.size(); ++i) {
      const std::uint32_t a = sorted_[i], b = sorted_[i + 1];
      if (same_edge(a, b) && together.join(a / 3, b / 3)) --report_.components;
    }
  }

  double volume_m3() const {
    EnclosedVolume volume;
    for (std::uint32_t t = 0; t < triangles(); ++t) {
      if (dead(t)) continue;
      const VertexId* v = &corner_[3 * std::size_t{t}];
      volume.add(position_[v[0]], position_[v[1]], position_[v[2]]);
    }
    return volume.m3();
  }

  std::vector<VertexId> corner_;
  std::span<const Vec3> position_;
  bool dead_slots_;
  std::vector<std::uint32_t> bucket_;  // by lower vertex: where its half-edges begin in sorted_
  std::vector<std::uint32_t> sorted_;
  std::vector<std::uint32_t> twin_;
  std::int64_t edges_ = 0;
  SurfaceReport report_;
};

// Checks that the neighbours and incident triangles that a mesh stores are those of its triangles.
void check_adjacency(const TriangleMesh& mesh, SurfaceCheck& surface) {
  const auto twins = surface.twins();
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
    if (!mesh.triangle(t).alive()) continue;
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t twin = twins[3 * std::size_t{t} + static_cast<std::size_t>(i)];
      if (mesh.neighbour(t, i) != (twin == kNone ? kNone : twin / 3)) {
        surface.add_defect(&SurfaceReport::manifold,
                           "triangle " + std::to_string(t) + " stores a wrong neighbour at edge " + std::to_string(i));
      }
    }
  }
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (!mesh.vertex_alive(v)) continue;
    const TriangleId t = mesh.incident(v);
    if (t >= mesh.triangle_slots() || mesh.triangle(t).corner_of(v) < 0) {
      surface.add_defect(&SurfaceReport::manifold,
                         "vertex " + std::to_string(v) + " stores a triangle that is not at it");
    }
  }
}

}  // namespace

SurfaceReport check(const TriangleMesh& mesh, std::span<const Vec3> positions_m) {
  if (positions_m.size() != mesh.vertex_slots()) {
    SurfaceReport report;
    report.finite = false;
    report.defects = 1;
    report.first_defect = "positions and vertex slots differ in number";
    return report;
  }
  std::vector<VertexId> corners;
  corners.reserve(3 * std::size_t{mesh.triangle_slots()});
  for (const Triangle& triangle : mesh.triangles()) corners.insert(corners.end(), triangle.v.begin(), triangle.v.end());
  SurfaceCheck surface(std::move(corners), positions_m, true);
  surface.run([&](VertexId v) { return mesh.vertex_alive(v); });
  if (!surface.twins().empty()) check_adjacency(mesh, surface);
  return surface.report();
}

SurfaceReport check_soup(const TriangleSoup& soup) {
  std::vector<VertexId> corners;
  corners.reserve(3 * soup.triangles.size());
  for (const auto& triangle : soup.triangles) corners.insert(corners.end(), triangle.begin(), triangle.end());
  SurfaceCheck surface(std::move(corners), soup.vertices_body_m, false);
  return surface.run([](VertexId) { return true; });
}

std::vector<std::uint32_t> component_of_triangle(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> label(mesh.triangle_slots(), kNone);
  std::vector<TriangleId> open;
  std::uint32_t components = 0;
  for (TriangleId seed = 0; seed < mesh.triangle_slots(); ++seed) {
    if (!mesh.triangle(seed).alive() || label[seed] != kNone) continue;
    label[seed] = components;
    open.push_back(seed);
    while (!open.empty()) {
      const TriangleId t = open.back();
      open.pop_back();
      for (const TriangleId n : mesh.neighbours(t)) {
        if (n == kNone || label[n] != kNone) continue;
        label[n] = components;
        open.push_back(n);
      }
    }
    ++components;
  }
  return label;
}

double enclosed_m3(std::span<const Vec3> vertices_m, std::span<const Triangle> triangles) {
  EnclosedVolume volume;
  for (const Triangle& t : triangles)
    if (t.alive()) volume.add(vertices_m[t.v[0]], vertices_m[t.v[1]], vertices_m[t.v[2]]);
  return volume.m3();
}

std::vector<double> component_rest_volumes_m3(const TriangleMesh& mesh, std::span<const std::uint32_t> component) {
  std::vector<EnclosedVolume> volumes;
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
    if (component[t] == kNone) continue;
    if (component[t] >= volumes.size()) volumes.resize(component[t] + 1);
    const auto& [a, b, c] = mesh.triangle(t).v;
    volumes[component[t]].add(mesh.rest_body_m(a), mesh.rest_body_m(b), mesh.rest_body_m(c));
  }
  std::vector<double> m3;
  m3.reserve(volumes.size());
  for (const EnclosedVolume& volume : volumes) m3.push_back(volume.m3());
  return m3;
}

std::string flaw_of_size(std::span<const Vec3> vertices_m) {
  constexpr double kSmallestBody_m = 1e-3, kLargestBody_m = 5;
  Eigen::AlignedBox3d box;
  for (const Vec3& p : vertices_m) box.extend(p);
  const double size_m = box.diagonal().norm();
  if (size_m >= kSmallestBody_m && size_m <= kLargestBody_m) return {};
  return "the mesh would be " + std::to_string(size_m) + " m across; is its unit another one?";
}

}  // namespace sectio
