#include "sim_server/deformation/spring_star.h"

#include <algorithm>
#include <cmath>

#include "common/core/error.h"

namespace sectio {
namespace {

// Largest (A_1 + A_2) / l^2, which is 0.87 for two equilateral triangles. The ratio has no limit for a short edge
// between slivers; beyond this value such an edge is rigid for every purpose, and only costs added mass.
constexpr double kMaxShape = 25;

Vec3 area_vector_m2(const TriangleMesh& mesh, const Triangle& t) {
  const Vec3& a = mesh.rest_body_m(t.v[0]);
  return 0.5 * (mesh.rest_body_m(t.v[1]) - a).cross(mesh.rest_body_m(t.v[2]) - a);
}
double area_m2(const TriangleMesh& mesh, const Triangle& t) {
  return area_vector_m2(mesh, t).norm();
}

}  // namespace

void gather_star(const TriangleMesh& mesh, VertexId v, const MembraneConstants& membrane, SpringStar& star) {
  star.half_edges.clear();
  star.spokes.clear();
  star.area_m2 = 0;
  star.pull_n = star.outward_m2 = Vec3::Zero();
  star.whole_skin = true;
  Mat3 stiffness = Mat3::Zero();
  for (const TriangleId t : mesh.fan(v)) {
    const Triangle& triangle = mesh.triangle(t);
    const int corner = triangle.corner_of(v);
    SECTIO_ASSERT(corner >= 0, "the triangles around a vertex name it");
    // The edge v -> to lies between this triangle and the one before it in the fan.
    const VertexId to = triangle.v[static_cast<std::size_t>((corner + 1) % 3)];
    const Triangle& across = mesh.triangle(mesh.neighbour(t, corner));
    const double area = area_m2(mesh, triangle);
    const double skin_share = 0.5 * ((triangle.surface == Surface::skin) + (across.surface == Surface::skin));
    const Vec3 edge = mesh.rest_body_m(to) - mesh.rest_body_m(v);
    const double l2 = edge.squaredNorm();
    const double shape = (area + area_m2(mesh, across)) / std::max(l2, 1e-30);
    const double k = membrane.young_n_per_m * std::min(shape, kMaxShape);
    const double strain = membrane.pretension * skin_share;
    star.half_edges.push_back({to, static_cast<float>(k), static_cast<float>(k * (1 - strain) * std::sqrt(l2))});
    star.area_m2 += area / 3;
    star.spokes.push_back({to, k * strain * edge, area_vector_m2(mesh, triangle)});
    star.whole_skin = star.whole_skin && triangle.surface == Surface::skin;
    // K_ij = k [n n^T + (1 - l0/l)(I - n n^T)]
    stiffness += k * (strain * Mat3::Identity() + (1 - strain) / std::max(l2, 1e-30) * edge * edge.transpose());
    SECTIO_ASSERT(star.half_edges.size() <= mesh.triangle_slots(), "the walk around a vertex closes");
  }
  std::sort(star.half_edges.begin(), star.half_edges.end(),
            [](const HalfEdge& a, const HalfEdge& b) { return a.to < b.to; });
  std::ranges::sort(star.spokes, {}, &SpringStar::Spoke::to);
  for (const SpringStar::Spoke& spoke : star.spokes) {
    star.pull_n += spoke.pull_n;
    star.outward_m2 += spoke.area_m2;
  }
  star.stiffness_n_per_m = largest_eigenvalue_bound(stiffness);
}

std::vector<double> surface_masses_kg(const TriangleMesh& mesh, double area_density_kg_per_m2) {
  std::vector<double> area_at(mesh.vertex_slots(), 0), mass_kg(mesh.vertex_slots(), 0);
  double area_m2_all = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    for (const TriangleId t : mesh.fan(v)) area_at[v] += area_m2(mesh, mesh.triangle(t)) / 3;
    area_m2_all += area_at[v];
  }
  const double least_m2 = kLeastAreaShare * area_m2_all / std::max(1u, mesh.vertex_count());
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v)
    if (mesh.vertex_alive(v)) mass_kg[v] = area_density_kg_per_m2 * std::max(area_at[v], least_m2);
  return mass_kg;
}

double largest_eigenvalue_bound(const Mat3& a) {
  const double trace = a.trace();
  if (!(trace > 0)) return 0;
  Mat3 power = a / trace;
  for (int n = 0; n < 5; ++n) power = (power * power).eval();
  double bound = power.trace();
  for (int n = 0; n < 5; ++n) bound = std::sqrt(bound);
  return trace * bound;
}

Eigen::Array4d largest_eigenvalue_bounds(const FourSymmetric& a) {
  using Four = Eigen::Array4d;
  const Four trace = a[0] + a[3] + a[5], divisor = (trace > 0).select(trace, 1);
  Four xx = a[0] / divisor, xy = a[1] / divisor, xz = a[2] / divisor;
  Four yy = a[3] / divisor, yz = a[4] / divisor, zz = a[5] / divisor;
  for (int n = 0; n < 5; ++n) {
    const Four xx2 = xx * xx + xy * xy + xz * xz, yy2 = xy * xy + yy * yy + yz * yz, zz2 = xz * xz + yz * yz + zz * zz;
    const Four xy2 = xx * xy + xy * yy + xz * yz, xz2 = xx * xz + xy * yz + xz * zz, yz2 = xy * xz + yy * yz + yz * zz;
    xx = xx2, xy = xy2, xz = xz2, yy = yy2, yz = yz2, zz = zz2;
  }
  Four bound = xx + yy + zz;
  for (int n = 0; n < 5; ++n) bound = bound.sqrt();
  return (trace > 0).select(trace * bound, 0);
}

}  // namespace sectio
