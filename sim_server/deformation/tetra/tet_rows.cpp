#include "sim_server/deformation/tetra/tet_rows.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr std::size_t kWindow = 256;
constexpr std::uint32_t kLeastOverflowWidth = 8;

template <class T>
void append(std::vector<T>& columns, std::uint32_t count) {
  resize_slots(columns, columns.size() + count, T{});
}

}  // namespace

// Keeps the vertex's colour, or chooses the smallest one, such that no vertex of a common tetrahedron has the same.
void TetRows::choose_colour(VertexId v, std::span<const VertexId> star) {
  for (const VertexId w : star) {
    const std::uint32_t taken = colour_[w];
    if (w == v || taken == kNone) continue;
    if (taken >= taken_by_.size()) taken_by_.resize(taken + 1, kNone);
    taken_by_[taken] = v;
  }
  const auto is_taken = [&](std::uint32_t c) { return c < taken_by_.size() && taken_by_[c] == v; };
  if (colour_[v] == kNone || is_taken(colour_[v])) {
    std::uint32_t free = 0;
    while (is_taken(free)) ++free;
    colour_[v] = free;
    colours_ = std::max(colours_, free + 1);
  }
  // The next call may be for v again.
  for (const VertexId w : star)
    if (w != v && colour_[w] != kNone) taken_by_[colour_[w]] = kNone;
}

TetRows::Width TetRows::width_of(const VertexStar& star) {
  return {static_cast<std::uint32_t>(star.ascending().size()), static_cast<std::uint32_t>(star.corners().size())};
}

std::uint32_t TetRows::add_slice(std::uint32_t colour, Width width) {
  TetSlice slice;
  slice.colour = colour;
  slice.first_edge = static_cast<std::uint32_t>(edges_.size());
  slice.first_face = static_cast<std::uint32_t>(faces_.size());
  slice.edges = width.edges;
  slice.faces = width.faces;
  slice.weight_sum.fill(1);
  most_faces_ = std::max(most_faces_, slice.faces);
  append(edges_, slice.edges);
  append(faces_, slice.faces);
  append(blocks_, slice.faces);
  append(face_edges_, slice.faces);
  append(slices_, 1);
  slices_.back() = slice;
  return static_cast<std::uint32_t>(slices_.size() - 1);
}

// Orders rows by colour, then by number of faces within windows, and fills slices in this order.
void TetRows::layout() {
  std::vector<VertexId> order;
  for (VertexId v = 0; v < colour_.size(); ++v)
    if (colour_[v] != kNone) order.push_back(v);
  std::stable_sort(order.begin(), order.end(), [&](VertexId a, VertexId b) { return colour_[a] < colour_[b]; });
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    while (last < order.size() && last < first + kWindow && colour_[order[last]] == colour_[order[first]]) ++last;
    std::stable_sort(order.begin() + static_cast<std::ptrdiff_t>(first),
                     order.begin() + static_cast<std::ptrdiff_t>(last),
                     [&](VertexId a, VertexId b) { return width_[a].faces > width_[b].faces; });
    first = last;
  }
  for (std::size_t n = 0; n < order.size();) {
    const std::uint32_t colour = colour_[order[n]];
    Width width;
    std::size_t end = n;
    for (; end < order.size() && end < n + kLanes && colour_[order[end]] == colour; ++end) {
      width.edges = std::max(width.edges, width_[order[end]].edges);
      width.faces = std::max(width.faces, width_[order[end]].faces);
    }
    const std::uint32_t s = add_slice(colour, width);
    for (; n < end; ++n) {
      row_of_[order[n]] = s * kLanes + slices_[s].count;
      slices_[s].offset[slices_[s].count++] = byte_offset(order[n]);
    }
  }
  base_slices_ = static_cast<std::uint32_t>(slices_.size());
  rows_ = static_cast<std::uint32_t>(order.size());
}

void TetRows::build(const TetMesh& mesh, const TetStars& stars, const TetStiffness& stiffness) {
  *this = TetRows();
  const std::size_t vertices = mesh.vertices_body_m.size();
  colour_.assign(vertices, kNone);
  row_of_.assign(vertices, kNone);
  width_.resize(vertices);
  pressure_scale_.resize(vertices, 0.0f);
  VertexStar star;
  for (VertexId v = 0; v < vertices; ++v) {
    if (stars.of(v).empty()) continue;
    star.begin(mesh, stars, v);
    choose_colour(v, star.vertices());
    width_[v] = width_of(star);
  }
  layout();
  for (VertexId v = 0; v < vertices; ++v) {
    if (!contains(v)) continue;
    star.begin(mesh, stars, v);
    star.measure(mesh);
    write(v, star, stiffness);
  }
  give_room(colour_, row_of_, width_, pressure_scale_, slices_, edges_, faces_, blocks_, face_edges_);
}

std::uint32_t TetRows::take_overflow_lane(std::uint32_t colour, Width width) {
  width = {std::bit_ceil(std::max(width.edges, kLeastOverflowWidth)),
           std::bit_ceil(std::max(width.faces, kLeastOverflowWidth))};
  std::vector<std::uint32_t>& open = open_[{colour, width.edges, width.faces}];
  if (open.empty()) open.push_back(add_slice(colour, width));
  const std::uint32_t s = open.back(), lane = slices_[s].count++;
  if (slices_[s].count == kLanes) open.pop_back();
  ++overflow_rows_;
  return s * kLanes + lane;
}

void TetRows::copy_lane(const TetRows& from, std::uint32_t from_row, std::uint32_t to_row) {
  const TetSlice& source = from.slices_[from_row / kLanes];
  TetSlice& slice = slices_[to_row / kLanes];
  const std::uint32_t a = from_row % kLanes, b = to_row % kLanes;
  const std::uint32_t own = source.offset[a];
  slice.offset[b] = own;
  for (auto field : {&TetSlice::pressure_scale, &TetSlice::pressure_shift, &TetSlice::weight_sum,
                     &TetSlice::step_over_mass, &TetSlice::gravity_share, &TetSlice::bound})
    (slice.*field)[b] = (source.*field)[a];
  for (std::uint32_t e = 0; e < slice.edges; ++e) {
    TetEdgeColumn& to = edges_[slice.first_edge + e];
    const bool has = e < source.edges;
    to.offset[b] = has ? from.edges_[source.first_edge + e].offset[a] : own;
    to.weight[b] = has ? from.edges_[source.first_edge + e].weight[a] : 0;
  }
  for (std::uint32_t f = 0; f < slice.faces; ++f) {
    TetFaceColumn& to = faces_[slice.first_face + f];
    TetBlockColumn& block = blocks_[slice.first_face + f];
    to.a[b] = to.b[b] = to.c[b] = own;
    to.shear[b] = block.bulk[b] = 0;
    TetFaceEdges& edges = face_edges_[slice.first_face + f];
    edges.a[b] = edges.b[b] = edges.c[b] = 0;
    if (f >= source.faces) continue;
    const TetFaceColumn& column = from.faces_[source.first_face + f];
    to.a[b] = column.a[a];
    to.b[b] = column.b[a];
    to.c[b] = column.c[a];
    to.shear[b] = column.shear[a];
    block.bulk[b] = from.blocks_[source.first_face + f].bulk[a];
    const TetFaceEdges& edges_before = from.face_edges_[source.first_face + f];
    edges.a[b] = edges_before.a[a];
    edges.b[b] = edges_before.b[a];
    edges.c[b] = edges_before.c[a];
  }
}

// Moves the last row of the slice into the lane of v. Lanes without a row gather some vertex; their results are not
// stored.
void TetRows::vacate(VertexId v) {
  if (!contains(v)) return;
  const std::uint32_t row = row_of_[v], s = row / kLanes;
  TetSlice& slice = slices_[s];
  const std::uint32_t last = s * kLanes + slice.count - 1;
  if (row != last) {
    copy_lane(*this, last, row);
    row_of_[vertex_at(slice.offset[row % kLanes])] = row;
  }
  slice.weight_sum[last % kLanes] = 1;
  slice.step_over_mass[last % kLanes] = 0;
  if (s >= base_slices_) {
    if (slice.count == kLanes) open_[{slice.colour, slice.edges, slice.faces}].push_back(s);
    --overflow_rows_;
  }
  --slice.count;
  --rows_;
  row_of_[v] = kNone;
}

void TetRows::follow(std::size_t vertices) {
  for (auto* table : {&row_of_, &colour_}) resize_slots(*table, vertices, kNone);
  resize_slots(width_, vertices, Width{});
  resize_slots(pressure_scale_, vertices, 0.0f);
}

void TetRows::update(VertexId v, const VertexStar& star, const TetStiffness& stiffness) {
  if (star.corners().empty()) {
    vacate(v);
    colour_[v] = kNone;
    return;
  }
  choose_colour(v, star.vertices());
  width_[v] = width_of(star);
  if (contains(v)) {
    const TetSlice& slice = slices_[row_of_[v] / kLanes];
    if (slice.colour != colour_[v] || slice.edges < width_[v].edges || slice.faces < width_[v].faces) vacate(v);
  }
  if (!contains(v)) {
    row_of_[v] = take_overflow_lane(colour_[v], width_[v]);
    ++rows_;
  }
  write(v, star, stiffness);
}

void TetRows::compact_if_spread() {
  if (wants_compaction()) compact();
}

void TetRows::compact() {
  TetRows sorted;
  sorted.colour_ = colour_;
  sorted.width_ = width_;
  sorted.row_of_.assign(row_of_.size(), kNone);
  sorted.colours_ = colours_;
  sorted.step_s_ = step_s_;
  sorted.pressure_scale_ = pressure_scale_;
  sorted.layout();
  for (VertexId v = 0; v < row_of_.size(); ++v)
    if (contains(v)) sorted.copy_lane(*this, row_of_[v], sorted.row_of_[v]);
  *this = std::move(sorted);
}

void TetRows::write(VertexId v, const VertexStar& star, const TetStiffness& stiffness) {
  TetSlice& slice = slices_[row_of_[v] / kLanes];
  const std::uint32_t lane = row_of_[v] % kLanes;
  const std::span faces(faces_.data() + slice.first_face, slice.faces);
  const std::span edges(edges_.data() + slice.first_edge, slice.edges);
  TetBlockColumn* const blocks = blocks_.data() + slice.first_face;
  TetFaceEdges* const face_edges = face_edges_.data() + slice.first_face;
  const std::uint32_t own = byte_offset(v);
  edge_of_.assign(star.vertices().size(), 0);
  for (std::uint32_t n = 0; n < star.ascending().size(); ++n) edge_of_[star.ascending()[n]] = kBytesAtEdge * n;
  slice.offset[lane] = own;
  double volume = 0, bulk = 0;
  std::size_t f = 0;
  weights_.assign(star.vertices().size(), 0);
  for (const auto& [t, corner, at, shape] : star.corners()) {
    const auto& side = kTetFaces[corner];  // counter-clockwise from outside
    faces[f].a[lane] = byte_offset(star.vertices()[at[side[0]]]);
    faces[f].b[lane] = byte_offset(star.vertices()[at[side[2]]]);
    faces[f].c[lane] = byte_offset(star.vertices()[at[side[1]]]);
    face_edges[f].a[lane] = edge_of_[at[side[0]]];
    face_edges[f].b[lane] = edge_of_[at[side[2]]];
    face_edges[f].c[lane] = edge_of_[at[side[1]]];
    faces[f].shear[lane] = static_cast<float>(stiffness.shear_pa[t] / 6);
    blocks[f].bulk[lane] = static_cast<float>(stiffness.bulk_pa[t] / (36 * shape.volume_m3));
    ++f;
    volume += shape.volume_m3;
    bulk += stiffness.bulk_pa[t] * shape.volume_m3;
    for (std::size_t k = 0; k < 4; ++k)
      if (k != corner)
        weights_[at[k]] -= stiffness.shear_pa[t] * shape.volume_m3 * shape.gradient[corner].dot(shape.gradient[k]);
  }
  for (; f < faces.size(); ++f) {
    faces[f].a[lane] = faces[f].b[lane] = faces[f].c[lane] = own;
    faces[f].shear[lane] = blocks[f].bulk[lane] = 0;
    face_edges[f].a[lane] = face_edges[f].b[lane] = face_edges[f].c[lane] = 0;
  }
  bulk /= volume;
  double sum = 0;
  std::size_t e = 0;
  for (const std::uint32_t n : star.ascending()) {
    edges[e].offset[lane] = byte_offset(star.vertices()[n]);
    edges[e++].weight[lane] = static_cast<float>(weights_[n]);
    sum += weights_[n];
  }
  for (; e < edges.size(); ++e) {
    edges[e].offset[lane] = own;
    edges[e].weight[lane] = 0;
  }
  slice.pressure_scale[lane] = static_cast<float>(bulk / (24 * 6 * volume));
  slice.pressure_shift[lane] = static_cast<float>(bulk / 24);
  slice.weight_sum[lane] = static_cast<float>(sum);
  slice.step_over_mass[lane] = slice.gravity_share[lane] = slice.bound[lane] = 0;
  pressure_scale_[v] = slice.pressure_scale[lane];
}

void TetRows::set(VertexId v, const TetVertex& vertex) {
  TetSlice& slice = slices_[row_of_[v] / kLanes];
  const std::uint32_t lane = row_of_[v] % kLanes;
  slice.step_over_mass[lane] = static_cast<float>(step_s_ * vertex.inverse_mass);
  slice.gravity_share[lane] = static_cast<float>(vertex.gravity_share);
  double weights = 0;
  for (std::uint32_t e = 0; e < slice.edges; ++e)
    weights += std::abs(double{edges_[slice.first_edge + e].weight[lane]});
  slice.bound[lane] = static_cast<float>(2 * weights * vertex.inverse_mass);
}

void TetRows::set(std::span<const TetVertex> vertices, double step_s) {
  step_s_ = step_s;
  for (VertexId v = 0; v < vertices.size(); ++v)
    if (contains(v)) set(v, vertices[v]);
}

double TetRows::padding() const {
  double lanes = 0, used = 0;
  for (const TetSlice& slice : slices_) {
    lanes += kLanes * slice.faces;
    for (std::uint32_t lane = 0; lane < slice.count; ++lane)
      for (std::uint32_t f = 0; f < slice.faces; ++f)
        used += faces_[slice.first_face + f].a[lane] != slice.offset[lane];
  }
  return 1 - used / lanes;
}

}  // namespace sectio
