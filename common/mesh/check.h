// The invariants of a surface: closed, oriented, manifold, no T-junction. Pure functions; O(n log n).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

struct SurfaceReport {
  bool finite = true;
  bool closed = true;    // every directed edge has its opposite
  bool manifold = true;  // each directed edge once, each vertex one fan of at least three triangles
  std::uint32_t vertices = 0;
  std::uint32_t triangles = 0;
  std::uint32_t components = 0;
  std::int64_t euler_characteristic = 0;  // V - E + F over all components
  double volume_m3 = 0;                   // signed, of the given positions, by the divergence theorem
  std::uint32_t defects = 0;              // edges, vertices and triangles that break a rule
  std::string first_defect;               // empty when valid: what and where, for a person

  bool valid() const { return finite && closed && manifold; }
};

// positions_m has one entry a slot (rest or current); adjacency stored in the mesh is checked against the triangles.
SurfaceReport check(const TriangleMesh& mesh, std::span<const Vec3> positions_m);
inline SurfaceReport check(const TriangleMesh& mesh) {
  return check(mesh, mesh.rest_body_m());
}

// Checks triangles from a file, before a mesh is made of them.
SurfaceReport check_soup(const TriangleSoup& soup);

// Component label (0, 1, ...) of every triangle slot, in the order of their lowest triangle; kNone for dead slots.
std::vector<std::uint32_t> component_of_triangle(const TriangleMesh& mesh);
// The volume that live triangles enclose together.
double enclosed_m3(std::span<const Vec3> vertices_m, std::span<const Triangle> triangles);

// The volume at rest of each component, by its label.
std::vector<double> component_rest_volumes_m3(const TriangleMesh& mesh, std::span<const std::uint32_t> component);

// Empty, or a question for a person: no part of a patient is so large or so small, so the unit may be another one.
std::string flaw_of_size(std::span<const Vec3> vertices_m);

}  // namespace sectio
