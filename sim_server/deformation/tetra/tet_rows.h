// A volume of tetrahedra as its vertices see it, in sliced ELLPACK (SELL-16): a row a vertex, slices of 16 rows,
// columns of 16 edges or faces. Both drivers of the neo-Hookean solid (tet_solid.h) read the same data, and only
// gather. A slice holds one colour: no two of its vertices share a tetrahedron, so that the implicit driver may move
// all of them at once.
//
//   edge column   the neighbour and the weight w_ij = - sum_e mu_e V_e g_i . g_j  (the I_C term of linear tetrahedra is
//                 a constant Laplacian)
//   face column   the face a b c opposite the vertex, seen counter-clockwise from it: n = (b - a) x (c - a) points to
//                 the vertex, d V_e / d x_i = n / 6; mu_e / 6; kappa_e / (36 V_e)
// Padding edges have weight 0 and padding faces are thrice the vertex itself: they give nothing.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/mesh/tet_mesh.h"
#include "sim_server/deformation/spring_rows.h"

namespace sectio {

struct alignas(64) TetEdgeColumn {
  std::array<std::uint32_t, kLanes> offset{};
  std::array<float, kLanes> weight{};  // N/m
};

struct alignas(64) TetFaceColumn {
  std::array<std::uint32_t, kLanes> a{}, b{}, c{};
  std::array<float, kLanes> shear{};  // mu_e / 6, Pa
};

struct alignas(64) TetBlockColumn {
  std::array<float, kLanes> bulk{};  // kappa_e / (36 V_e), N/m^5
};

struct alignas(64) TetSlice {
  std::array<std::uint32_t, kLanes> offset{};
  std::array<float, kLanes> pressure_scale{};  // kappa_i / (24 sum_e 6 V_e)
  std::array<float, kLanes> pressure_shift{};  // kappa_i / 24
  std::array<float, kLanes> weight_sum{};      // sum_j w_ij, N/m; > 0
  std::array<float, kLanes> step_over_mass{};  // s/kg; 0 holds the vertex
  std::array<float, kLanes> gravity_share{};   // physical over effective mass
  std::array<float, kLanes> bound{};           // 2 sum_j |w_ij| / m_i, 1/s^2
  std::uint32_t first_edge = 0, edges = 0;     // columns
  std::uint32_t first_face = 0, faces = 0;
  std::uint32_t count = 0;  // rows, in lanes 0 .. count-1
  std::uint32_t colour = 0;
};

// What a solid is made of, one entry a tetrahedron.
struct TetStiffness {
  std::vector<double> shear_pa;  // mu
  std::vector<double> bulk_pa;   // kappa = lambda + mu
};

// Of a vertex, for its row.
struct TetVertex {
  double inverse_mass = 0;   // of the effective mass, 1/kg; 0 holds the vertex
  double gravity_share = 1;  // physical over effective mass
};

class TetRows {
 public:
  // O(n log n). Every vertex has a tetrahedron.
  void build(const TetMesh& mesh, const TetStiffness& stiffness);
  // Masses and step, to be called after build() and when they change. O(n).
  void set(std::span<const TetVertex> vertices, double step_s);
  float step_s() const { return step_s_; }

  std::span<const TetSlice> slices() const { return slices_; }
  std::span<const TetEdgeColumn> edges() const { return edges_; }
  std::span<const TetFaceColumn> faces() const { return faces_; }
  std::span<const TetBlockColumn> blocks() const { return blocks_; }
  // TetSlice::pressure_scale by vertex.
  std::span<const float> pressure_scale() const { return pressure_scale_; }
  std::uint32_t colours() const { return slices_.empty() ? 0 : slices_.back().colour + 1; }
  std::uint32_t most_faces() const { return most_faces_; }
  // Share of the face columns' lanes that are padding.
  double padding() const;

 private:
  std::vector<TetSlice> slices_;  // ascending in colour
  std::vector<TetEdgeColumn> edges_;
  std::vector<TetFaceColumn> faces_;
  std::vector<TetBlockColumn> blocks_;  // one a face column
  std::vector<float> pressure_scale_;
  std::uint32_t most_faces_ = 0;
  float step_s_ = 0;
};

}  // namespace sectio
