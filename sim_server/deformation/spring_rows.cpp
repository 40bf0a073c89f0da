#include "sim_server/deformation/spring_rows.h"

#include <algorithm>

#include "common/core/error.h"
#include "common/mesh/slot_table.h"

namespace sectio {
namespace {

constexpr std::uint32_t kWindow = 256;
constexpr std::uint32_t kOverflowWidth =
    8;  // columns of an overflow slice, or a multiple: unused ones cost time in every step

void clear_lane(SpringSlice& slice, std::span<SpringColumn> columns, std::uint32_t lane) {
  slice.offset[lane] = 0;
  slice.home_x[lane] = slice.home_y[lane] = slice.home_z[lane] = 0;
  slice.k_home[lane] = slice.step_over_mass[lane] = slice.gravity_share[lane] = 0;
  for (SpringColumn& column : columns) {
    column.offset[lane] = 0;
    column.k[lane] = column.k_l0[lane] = 0;
  }
}

void copy_lane(SpringSlice& slice, std::span<SpringColumn> columns, std::uint32_t from, std::uint32_t to) {
  slice.offset[to] = slice.offset[from];
  slice.home_x[to] = slice.home_x[from];
  slice.home_y[to] = slice.home_y[from];
  slice.home_z[to] = slice.home_z[from];
  slice.k_home[to] = slice.k_home[from];
  slice.step_over_mass[to] = slice.step_over_mass[from];
  slice.gravity_share[to] = slice.gravity_share[from];
  for (SpringColumn& column : columns) {
    column.offset[to] = column.offset[from];
    column.k[to] = column.k[from];
    column.k_l0[to] = column.k_l0[from];
  }
}

}  // namespace

void SpringRows::layout(std::span<const std::uint32_t> degrees) {
  *this = SpringRows();
  resize_slots(row_of_, degrees.size(), kNone);
  resize_slots(degree_, degrees.size(), 0u);
  std::vector<VertexId> order;
  for (std::size_t begin = 0; begin < degrees.size(); begin += kWindow) {
    const std::size_t first = order.size();
    for (std::size_t v = begin; v < std::min<std::size_t>(begin + kWindow, degrees.size()); ++v) {
      if (degrees[v] != kNone) order.push_back(static_cast<VertexId>(v));
    }
    std::stable_sort(order.begin() + static_cast<std::ptrdiff_t>(first), order.end(),
                     [&](VertexId a, VertexId b) { return degrees[a] > degrees[b]; });
  }
  std::vector<std::uint32_t> widths((order.size() + kLanes - 1) / kLanes, 0);
  std::size_t columns = 0;
  for (std::size_t n = 0; n < order.size(); ++n) {
    const std::uint32_t width = std::max(widths[n / kLanes], degrees[order[n]]);
    columns += width - widths[n / kLanes];
    widths[n / kLanes] = width;
  }
  slices_.reserve(with_room(widths.size()));
  columns_.reserve(with_room(columns));
  for (const std::uint32_t width : widths) add_slice(width);
  for (std::size_t n = 0; n < order.size(); ++n) {
    SpringSlice& slice = slices_[n / kLanes];
    slice.offset[slice.count++] = byte_offset(order[n]);
    row_of_[order[n]] = static_cast<std::uint32_t>(n);
  }
  base_slices_ = static_cast<std::uint32_t>(slices_.size());
  rows_ = static_cast<std::uint32_t>(order.size());
}

std::uint32_t SpringRows::add_slice(std::uint32_t width) {
  SpringSlice slice;
  slice.first_column = static_cast<std::uint32_t>(columns_.size());
  slice.width = width;
  columns_.resize(columns_.size() + width);
  slices_.push_back(slice);
  return static_cast<std::uint32_t>(slices_.size() - 1);
}

std::uint32_t SpringRows::take_overflow_lane(std::uint32_t degree) {
  const std::uint32_t size = std::max((degree + kOverflowWidth - 1) / kOverflowWidth, 1u);
  if (open_.size() <= size) open_.resize(size + 1);
  std::vector<std::uint32_t>& open = open_[size];
  if (open.empty()) open.push_back(add_slice(size * kOverflowWidth));
  const std::uint32_t s = open.back();
  const std::uint32_t lane = slices_[s].count++;
  if (slices_[s].count == kLanes) open.pop_back();
  ++overflow_rows_;
  return s * kLanes + lane;
}

void SpringRows::vacate(VertexId v) {
  const std::uint32_t s = row_of_[v] / kLanes;
  const std::uint32_t lane = row_of_[v] % kLanes;
  SpringSlice& slice = slices_[s];
  const std::span<SpringColumn> columns(columns_.data() + slice.first_column, slice.width);
  const std::uint32_t last = slice.count - 1;
  if (lane != last) {
    copy_lane(slice, columns, last, lane);
    row_of_[vertex_at(slice.offset[lane])] = s * kLanes + lane;
  }
  clear_lane(slice, columns, last);
  if (s >= base_slices_) {
    if (slice.count == kLanes) open_[slice.width / kOverflowWidth].push_back(s);
    --overflow_rows_;
  }
  --slice.count;
  row_of_[v] = kNone;
}

void SpringRows::set(VertexId v, const VertexRow& row, std::span<const HalfEdge> half_edges) {
  if (v >= row_of_.size()) {
    resize_slots(row_of_, v + 1, kNone);
    resize_slots(degree_, v + 1, 0u);
  }
  const auto degree = static_cast<std::uint32_t>(half_edges.size());
  if (row_of_[v] != kNone && degree > slices_[row_of_[v] / kLanes].width) remove(v);
  if (row_of_[v] == kNone) {
    row_of_[v] = take_overflow_lane(degree);
    ++rows_;
  }
  degree_[v] = degree;
  SpringSlice& slice = slices_[row_of_[v] / kLanes];
  const std::uint32_t lane = row_of_[v] % kLanes;
  slice.offset[lane] = byte_offset(v);
  slice.k_home[lane] = row.k_home;
  slice.step_over_mass[lane] = row.step_over_mass;
  slice.gravity_share[lane] = row.gravity_share;
  set_home(v, row.home_world_m);
  for (std::uint32_t n = 0; n < slice.width; ++n) {
    SpringColumn& column = columns_[slice.first_column + n];
    const HalfEdge half_edge = n < degree ? half_edges[n] : HalfEdge{v, 0, 0};
    column.offset[lane] = byte_offset(half_edge.to);
    column.k[lane] = half_edge.k;
    column.k_l0[lane] = half_edge.k_l0;
  }
}

void SpringRows::set_mass(VertexId v, float step_over_mass, float gravity_share) {
  SpringSlice& slice = slices_[row_of_[v] / kLanes];
  slice.step_over_mass[row_of_[v] % kLanes] = step_over_mass;
  slice.gravity_share[row_of_[v] % kLanes] = gravity_share;
}

void SpringRows::set_constants(VertexId v, std::uint32_t n, float k, float k_l0) {
  SpringColumn& column = columns_[slices_[row_of_[v] / kLanes].first_column + n];
  column.k[row_of_[v] % kLanes] = k;
  column.k_l0[row_of_[v] % kLanes] = k_l0;
}

void SpringRows::remove(VertexId v) {
  if (!contains(v)) return;
  vacate(v);
  degree_[v] = 0;
  --rows_;
}

void SpringRows::set_home(VertexId v, const Vec3f& home_world_m) {
  SpringSlice& slice = slices_[row_of_[v] / kLanes];
  const std::uint32_t lane = row_of_[v] % kLanes;
  slice.home_x[lane] = home_world_m.x();
  slice.home_y[lane] = home_world_m.y();
  slice.home_z[lane] = home_world_m.z();
}

VertexRow SpringRows::row(VertexId v) const {
  const SpringSlice& slice = slices_[row_of_[v] / kLanes];
  const std::uint32_t lane = row_of_[v] % kLanes;
  return {Vec3f(slice.home_x[lane], slice.home_y[lane], slice.home_z[lane]), slice.k_home[lane],
          slice.step_over_mass[lane], slice.gravity_share[lane]};
}

HalfEdge SpringRows::half_edge(VertexId v, std::uint32_t n) const {
  SECTIO_ASSERT(n < degree_[v], "half-edge out of range");
  const SpringColumn& column = columns_[slices_[row_of_[v] / kLanes].first_column + n];
  const std::uint32_t lane = row_of_[v] % kLanes;
  return {vertex_at(column.offset[lane]), column.k[lane], column.k_l0[lane]};
}

void SpringRows::compact() {
  std::vector<std::uint32_t> degrees(row_of_.size());
  for (VertexId v = 0; v < degrees.size(); ++v) degrees[v] = contains(v) ? degree_[v] : kNone;
  SpringRows sorted;
  sorted.layout(degrees);
  std::vector<HalfEdge> half_edges;
  for (VertexId v = 0; v < degrees.size(); ++v) {
    if (!contains(v)) continue;
    half_edges.clear();
    for (std::uint32_t n = 0; n < degree_[v]; ++n) half_edges.push_back(half_edge(v, n));
    sorted.set(v, row(v), half_edges);
  }
  *this = std::move(sorted);
}

}  // namespace sectio
