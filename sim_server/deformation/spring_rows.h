// Half-edges of a spring network, one row a vertex, in sliced ELLPACK (SELL-16): slices of 16 rows, columns of 16
// half-edges, rows sorted by degree in windows of 256 so that slices are nearly full. A row only gathers: there are no
// write conflicts, and a vertex's sum has the same order wherever its row lies, so the layout never changes a result.
//
//   slice s:  lane         0    1    2  ..  15        A row that outgrows its slice moves to an overflow slice;
//             column 0    j00  j10  j20                when these hold a fifth of all rows, compact() sorts anew.
//             column 1    j01  j11  j21                Padding half-edges have k = 0 and point at their own vertex.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/math/types.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

constexpr std::uint32_t kLanes = 16;

// Vertices are stored as byte offsets into arrays of 16-byte entries: the kernel's loads then need no shift.
constexpr std::uint32_t byte_offset(VertexId v) {
  return v * 16u;
}
constexpr VertexId vertex_at(std::uint32_t offset) {
  return offset / 16u;
}

struct alignas(64) SpringColumn {
  std::array<std::uint32_t, kLanes> offset{};
  std::array<float, kLanes> k{};     // N/m
  std::array<float, kLanes> k_l0{};  // N: stiffness times rest length

  template <class A>
  void archive(A& a) {
    a(offset, k, k_l0);
  }
};

struct alignas(64) SpringSlice {
  std::array<std::uint32_t, kLanes> offset{};
  std::array<float, kLanes> home_x{}, home_y{}, home_z{};  // world, m
  std::array<float, kLanes> k_home{};                      // N/m
  std::array<float, kLanes> step_over_mass{};              // s/kg; 0 holds the vertex
  std::array<float, kLanes> gravity_share{};               // physical over effective mass
  std::uint32_t first_column = 0;
  std::uint32_t width = 0;  // columns
  std::uint32_t count = 0;  // rows, in lanes 0 .. count-1

  template <class A>
  void archive(A& a) {
    a(offset, home_x, home_y, home_z, k_home, step_over_mass, gravity_share, first_column, width, count);
  }
};

struct HalfEdge {
  VertexId to = kNone;
  float k = 0;
  float k_l0 = 0;
  bool operator==(const HalfEdge&) const = default;

  // 0 for a spring without stiffness, which has none.
  double rest_length_m() const { return k > 0 ? double{k_l0} / double{k} : 0; }
};

struct VertexRow {
  Vec3f home_world_m = Vec3f::Zero();
  float k_home = 0;
  float step_over_mass = 0;
  float gravity_share = 0;
  bool operator==(const VertexRow&) const = default;
};

class SpringRows {
 public:
  // Makes empty rows with room for degrees[v] half-edges, and none where that is kNone. O(n log 256).
  void layout(std::span<const std::uint32_t> degrees);

  // Creates or replaces the row of v. O(degree).
  void set(VertexId v, const VertexRow& row, std::span<const HalfEdge> half_edges);
  // Change a row's mass, or the constants of its n-th spring, and nothing else.
  void set_mass(VertexId v, float step_over_mass, float gravity_share);
  void set_constants(VertexId v, std::uint32_t n, float k, float k_l0);
  void remove(VertexId v);
  void set_home(VertexId v, const Vec3f& home_world_m);

  bool contains(VertexId v) const { return v < row_of_.size() && row_of_[v] != kNone; }
  std::uint32_t degree(VertexId v) const { return degree_[v]; }
  VertexRow row(VertexId v) const;
  HalfEdge half_edge(VertexId v, std::uint32_t n) const;

  std::uint32_t row_count() const { return rows_; }
  std::uint32_t overflow_row_count() const { return overflow_rows_; }
  bool wants_compaction() const { return overflow_rows_ > 256 && overflow_rows_ > rows_ / 5; }
  // O(all rows).
  void compact();

  std::span<const SpringSlice> slices() const { return slices_; }
  std::span<const SpringColumn> columns() const { return columns_; }

  template <class A>
  void archive(A& a) {
    a(slices_, columns_, row_of_, degree_, open_, base_slices_, rows_, overflow_rows_);
  }

 private:
  std::uint32_t add_slice(std::uint32_t width);
  std::uint32_t take_overflow_lane(std::uint32_t degree);
  void vacate(VertexId v);

  std::vector<SpringSlice> slices_;
  std::vector<SpringColumn> columns_;
  std::vector<std::uint32_t> row_of_;  // slice * kLanes + lane
  std::vector<std::uint32_t> degree_;
  std::vector<std::vector<std::uint32_t>> open_;  // overflow slices with a free lane, by width / kOverflowWidth
  std::uint32_t base_slices_ = 0;
  std::uint32_t rows_ = 0;
  std::uint32_t overflow_rows_ = 0;
};

}  // namespace sectio
