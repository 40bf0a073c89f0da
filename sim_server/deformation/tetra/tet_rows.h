// A volume of tetrahedra by vertex, in sliced ELLPACK (SELL-16): one row a vertex, slices of 16 rows, columns of 16
// edges or faces. Both integrators of the neo-Hookean solid (tet_solid.h) read the same data, and only gather. A slice
// has one colour: no two of its vertices share a tetrahedron, so that an implicit sweep may move all of them at once. A
// row that is new, or outgrows its slice, goes to an overflow slice of its colour; when these hold a tenth of the rows,
// all rows are laid out anew. Rows whose faces lie between their edges in the same way, as most do in a lattice, get
// slices of their own: there the corners of a face are the same edges in all lanes, and a loop that has gathered the
// neighbours once needs to gather no face.
//
//   edge column   the neighbour and the weight w_ij = - sum_e mu_e V_e g_i . g_j  (the I_C term of linear tetrahedra is
//                 a constant Laplacian)
//   face column   the face a b c opposite the vertex, seen counter-clockwise from it: n = (b - a) x (c - a) points to
//                 the vertex, d V_e / d x_i = n / 6; mu_e / 6; kappa_e / (36 V_e)
// Padding edges have weight 0, and padding faces name the vertex itself three times: both contribute nothing.
#pragma once

#include <array>
#include <map>
#include <span>
#include <vector>

#include "common/mesh/tet_mesh.h"
#include "sim_server/deformation/spring_rows.h"
#include "sim_server/deformation/tetra/tet_star.h"

namespace sectio {

struct alignas(64) TetEdgeColumn {
  std::array<std::uint32_t, kLanes> offset{};
  std::array<float, kLanes> weight{};  // N/m

  template <class A>
  void archive(A& a) {
    a(offset, weight);
  }
};

struct alignas(64) TetFaceColumn {
  std::array<std::uint32_t, kLanes> a{}, b{}, c{};
  std::array<float, kLanes> shear{};  // mu_e / 6, Pa

  template <class A>
  void archive(A& ar) {
    ar(a, b, c, shear);
  }
};

// For the corners of a face, where a row's sums at its edges to them begin: bytes from the row's first.
struct alignas(64) TetFaceEdges {
  std::array<std::uint32_t, kLanes> a{}, b{}, c{};

  template <class A>
  void archive(A& ar) {
    ar(a, b, c);
  }
};
constexpr std::uint32_t kBytesAtEdge = 48;

// The same for all lanes of a slice whose rows are alike: numbers of edges.
struct TetAlikeFace {
  std::uint8_t a = 0, b = 0, c = 0;

  template <class A>
  void archive(A& ar) {
    ar(a, b, c);
  }
};
constexpr std::uint32_t kMostAlikeEdges = 32;

struct alignas(64) TetBlockColumn {
  std::array<float, kLanes> bulk{};  // kappa_e / (36 V_e), N/m^5

  template <class A>
  void archive(A& a) {
    a(bulk);
  }
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
  std::uint32_t used_edges = 0, used_faces = 0;  // columns that aren't padding in all lanes, and maybe some that are
  std::uint32_t count = 0;                       // rows, in lanes 0 .. count-1
  std::uint32_t colour = 0;
  bool alike = false;  // its rows are alike: see TetRows::alike_faces()

  template <class A>
  void archive(A& a) {
    a(offset, pressure_scale, pressure_shift, weight_sum, step_over_mass, gravity_share, bound, first_edge, edges,
      first_face, faces, used_edges, used_faces, count, colour, alike);
  }
};

// The elastic constants of a solid, one entry a tetrahedron.
struct TetStiffness {
  std::vector<double> shear_pa;  // mu
  std::vector<double> bulk_pa;   // kappa = lambda + mu

  template <class A>
  void archive(A& a) {
    a(shear_pa, bulk_pa);
  }
};

// The mass of a vertex, for its row.
struct TetVertex {
  double inverse_mass = 0;   // the effective mass, 1/kg; 0 holds the vertex
  double gravity_share = 1;  // physical over effective mass
};

class TetRows {
 public:
  // Gives every vertex of a tetrahedron a row, without mass. O(n log n). `puts_alike_together`: rows that are alike get
  // slices of their own, for loops that move nothing within a pass. Others add in the order of the rows.
  void build(const TetMesh& mesh, const TetStars& stars, const TetStiffness& stiffness,
             bool puts_alike_together = false);
  // Follow a change of the tetrahedra: call follow(), then update() for each vertex whose tetrahedra have changed, then
  // compact_if_spread(). update() rewrites the vertex's row, without mass, or removes it. A vertex keeps its colour
  // unless a neighbour has the same; then it gets the smallest free one. O(degree); compaction, rarely, O(all rows).
  void follow(std::size_t vertices);
  void update(VertexId v, const VertexStar& star, const TetStiffness& stiffness);
  // `share`: the largest share of rows that may be in overflow slices.
  void compact_if_spread(double share);
  // Called between cuts: reserves again for slices, which grow with every cut.
  void renew_room();
  // Set the masses and the step of all rows, O(n), or the mass of one row.
  void set(std::span<const TetVertex> vertices, double step_s);
  void set(VertexId v, const TetVertex& vertex);
  float step_s() const { return static_cast<float>(step_s_); }

  std::span<const TetSlice> slices() const { return slices_; }
  std::span<const TetEdgeColumn> edges() const { return edges_; }
  std::span<const TetFaceColumn> faces() const { return faces_; }
  std::span<const TetBlockColumn> blocks() const { return blocks_; }
  std::span<const TetFaceEdges> face_edges() const { return face_edges_; }
  std::span<const TetAlikeFace> alike_faces() const {
    return alike_faces_;
  }  // one a face column; where slices are alike
  // TetSlice::pressure_scale by vertex.
  std::span<const float> pressure_scale() const { return pressure_scale_; }
  bool contains(VertexId v) const { return v < row_of_.size() && row_of_[v] != kNone; }
  std::uint32_t colour(VertexId v) const { return colour_[v]; }
  std::uint32_t colours() const { return colours_; }
  std::uint32_t most_faces() const { return most_faces_; }
  std::uint32_t row_count() const { return rows_; }
  std::uint32_t overflow_row_count() const { return overflow_rows_; }
  // The share of padding in the lanes of the face columns.
  double padding() const;

  template <class A>
  void archive(A& a) {
    a(slices_, edges_, faces_, blocks_, face_edges_, alike_faces_, pressure_scale_, row_of_, colour_, width_, pattern_,
      open_, puts_alike_together_, base_slices_, rows_, overflow_rows_, colours_, most_faces_, taken_by_, step_s_);
  }

 private:
  // The columns that a row needs.
  struct Width {
    std::uint32_t edges = 0, faces = 0;

    template <class A>
    void archive(A& a) {
      a(edges, faces);
    }
  };
  static Width width_of(const VertexStar& star);
  static void use(TetSlice& slice, Width width);
  void number_edges(const VertexStar& star);
  std::uint64_t pattern_of(const VertexStar& star);
  void order(std::span<VertexId> of_one_colour) const;
  void layout();
  void find_alike();
  bool is_alike(const TetSlice& slice, std::uint32_t lane, std::uint32_t other) const;
  void compact();
  std::uint32_t add_slice(std::uint32_t colour, Width width);
  std::uint32_t take_overflow_lane(std::uint32_t colour, Width width);
  void copy_lane(const TetRows& from, std::uint32_t from_row, std::uint32_t to_row);
  void vacate(VertexId v);
  void write(VertexId v, const VertexStar& star, const TetStiffness& stiffness);
  void choose_colour(VertexId v, std::span<const VertexId> star);

  std::vector<TetSlice> slices_;  // ascending in colour, except for overflow slices at the end
  std::vector<TetEdgeColumn> edges_;
  std::vector<TetFaceColumn> faces_;
  std::vector<TetBlockColumn> blocks_;     // one a face column
  std::vector<TetFaceEdges> face_edges_;   // likewise
  std::vector<TetAlikeFace> alike_faces_;  // likewise
  std::vector<float> pressure_scale_;
  std::vector<std::uint32_t> row_of_, colour_;  // by vertex; a row is slice * kLanes + lane; kNone: none
  std::vector<Width> width_;                    // by vertex
  std::vector<std::uint64_t> pattern_;          // likewise: rows that are alike have the same, others hardly ever
  std::map<std::array<std::uint32_t, 3>, std::vector<std::uint32_t>> open_;  // overflow slices with a free lane
  bool puts_alike_together_ = false;
  std::uint32_t base_slices_ = 0, rows_ = 0, overflow_rows_ = 0;
  std::uint32_t colours_ = 0, most_faces_ = 0;
  std::vector<VertexId> taken_by_;      // by colour; scratch
  std::vector<double> weights_;         // scratch
  std::vector<std::uint32_t> edge_of_;  // scratch
  double step_s_ = 0;
};

}  // namespace sectio
