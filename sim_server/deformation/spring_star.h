// The springs at one vertex. They depend on the triangles around it only, so a change of topology recomputes the stars
// that it touches.
#pragma once

#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "sim_server/deformation/spring_rows.h"

namespace sectio {

struct MembraneConstants {
  double young_n_per_m = 0;  // E_2D = E t_skin
  double pretension = 0;
};

struct SpringStar {
  // One for each edge, with the triangle that follows it around the vertex.
  struct Spoke {
    VertexId to;
    Vec3 pull_n, area_m2;
  };
  std::vector<HalfEdge> half_edges;  // ascending in HalfEdge::to, so that sums have one order whatever the history
  std::vector<Spoke> spokes;         // likewise
  double area_m2 = 0;                // a third of the area of the triangles around the vertex, at rest
  double stiffness_n_per_m = 0;      // >= the largest eigenvalue of sum_j K_ij at rest, within 3.5 %
  Vec3 outward_m2 = Vec3::Zero();    // the area around the vertex as a vector, at rest, in the body's frame
  Vec3 pull_n = Vec3::Zero();        // by the springs on the vertex at rest
  bool whole_skin = true;            // all triangles around the vertex are skin
};

// k_ij = E_2D (A_1 + A_2) / l_ij^2 over the two triangles at the edge (2-D Cauchy-Born; Van Gelder 1998). This fits
// E_2D at nu = 1/3, the only Poisson's ratio that a plane net of central forces has. Rest lengths are (1 - pretension)
// l_ij where both triangles are skin and l_ij where both are wall: the organ's capsule is stretched, the inside of a
// cut is not, so that a cut gapes. v must be alive; `star` is overwritten, its memory kept. O(degree).
void gather_star(const TriangleMesh& mesh, VertexId v, const MembraneConstants& membrane, SpringStar& star);

// The masses of a surface that stands for tissue of this much mass per area, by vertex slot; 0 for dead slots. A vertex
// gets at least kLeastAreaShare of the mean area, so that crumbs left by a cut are not almost massless.
constexpr double kLeastAreaShare = 1e-4;
std::vector<double> surface_masses_kg(const TriangleMesh& mesh, double area_density_kg_per_m2);

// An upper bound on the largest eigenvalue of a symmetric positive semidefinite matrix: tr(A^32)^(1/32), at most
// 3^(1/32) = 1.035 times too large. Only sums, products and square roots, hence the same bits on every machine.
double largest_eigenvalue_bound(const Mat3& a);

// The same bound for four matrices at once, equal up to rounding. Components: xx xy xz yy yz zz.
using FourSymmetric = std::array<Eigen::Array4d, 6>;
Eigen::Array4d largest_eigenvalue_bounds(const FourSymmetric& a);

}  // namespace sectio
