#include "sim_server/deformation/tetra/tet_rows.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr std::size_t kWindow = 256;
constexpr std::uint32_t kLeastOverflowWidth = 8;
constexpr std::uint32_t kLeastOverflowEdges = 16, kLeastOverflowFaces = 32;  // padding costs nothing there

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
  slice.used_edges = slice.used_faces = 0;
  slice.weight_sum.fill(1);
  most_faces_ = std::max(most_faces_, slice.faces);
  append(edges_, slice.edges);
  append(faces_, slice.faces);
  append(blocks_, slice.faces);
  append(face_edges_, slice.faces);
  append(alike_faces_, slice.faces);
  append(slices_, 1);
  slices_.back() = slice;
  return static_cast<std::uint32_t>(slices_.size() - 1);
}

void TetRows::number_edges(const VertexStar& star) {
  edge_of_.assign(star.vertices().size(), 0);
  for (std::uint32_t n = 0; n < star.ascending().size(); ++n) edge_of_[star.ascending()[n]] = kBytesAtEdge * n;
}

// A hash of the edges at the corners of all faces.
std::uint64_t TetRows::pattern_of(const VertexStar& star) {
  number_edges(star);
  std::uint64_t hash = star.corners().size();
  for (const VertexStar::Corner& c : star.corners())
    for (const std::size_t k : kTetFaces[c.corner])
      hash = (hash ^ hash >> 29 ^ edge_of_[c.at[k]]) * 0x9e3779b97f4a7c15u;
  return hash;
}

// First rows that fill slices with their like, then the others by number of faces within windows.
void TetRows::order(std::span<VertexId> of_one_colour) const {
  std::vector<VertexId> by_pattern(of_one_colour.begin(), of_one_colour.end()), alike, others;
  std::ranges::stable_sort(by_pattern, {}, [&](VertexId v) { return pattern_[v]; });
  for (std::size_t first = 0; first < by_pattern.size();) {
    std::size_t last = first;
    while (last < by_pattern.size() && pattern_[by_pattern[last]] == pattern_[by_pattern[first]]) ++last;
    const bool may_be = puts_alike_together_ && width_[by_pattern[first]].edges <= kMostAlikeEdges;
    const std::size_t full = may_be ? first + (last - first) / kLanes * kLanes : first;
    for (; first < full; ++first) alike.push_back(by_pattern[first]);
    for (; first < last; ++first) others.push_back(by_pattern[first]);
  }
  std::ranges::sort(others);
  for (std::size_t first = 0; first < others.size(); first += kWindow) {
    const std::size_t count = std::min(kWindow, others.size() - first);
    std::ranges::stable_sort(std::span(others).subspan(first, count), std::greater<>(),
                             [&](VertexId v) { return width_[v].faces; });
  }
  std::ranges::copy(others, std::ranges::copy(alike, of_one_colour.begin()).out);
}

// Orders rows by colour, and fills slices.
void TetRows::layout() {
  std::vector<VertexId> order;
  for (VertexId v = 0; v < colour_.size(); ++v)
    if (colour_[v] != kNone) order.push_back(v);
  std::stable_sort(order.begin(), order.end(), [&](VertexId a, VertexId b) { return colour_[a] < colour_[b]; });
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    while (last < order.size() && colour_[order[last]] == colour_[order[first]]) ++last;
    this->order(std::span(order).subspan(first, last - first));
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

bool TetRows::is_alike(const TetSlice& slice, std::uint32_t lane, std::uint32_t other) const {
  return std::ranges::all_of(std::span(face_edges_).subspan(slice.first_face, slice.faces), [&](const TetFaceEdges& e) {
    return e.a[lane] == e.a[other] && e.b[lane] == e.b[other] && e.c[lane] == e.c[other];
  });
}

// Once all rows are written. Padding has one edge at all corners of a face, a face doesn't.
void TetRows::find_alike() {
  for (TetSlice& slice : slices_) {
    slice.alike = slice.count == kLanes && slice.edges <= kMostAlikeEdges;
    for (std::uint32_t lane = 1; lane < kLanes && slice.alike; ++lane) slice.alike = is_alike(slice, lane, 0);
    if (!slice.alike) continue;
    for (std::uint32_t f = slice.first_face; f < slice.first_face + slice.faces; ++f) {
      const auto edge = [](std::uint32_t at) { return static_cast<std::uint8_t>(at / kBytesAtEdge); };
      const TetFaceEdges& e = face_edges_[f];
      alike_faces_[f] = {edge(e.a[0]), edge(e.b[0]), edge(e.c[0])};
    }
  }
}

void TetRows::build(const TetMesh& mesh, const TetStars& stars, const TetStiffness& stiffness,
                    bool puts_alike_together) {
  *this = TetRows();
  puts_alike_together_ = puts_alike_together;
  const std::size_t vertices = mesh.vertices_body_m.size();
  colour_.assign(vertices, kNone);
  row_of_.assign(vertices, kNone);
  width_.resize(vertices);
  pattern_.resize(vertices, 0);
  pressure_scale_.resize(vertices, 0.0f);
  VertexStar star;
  for (VertexId v = 0; v < vertices; ++v) {
    if (stars.of(v).empty()) continue;
    star.begin(mesh, stars, v);
    choose_colour(v, star.vertices());
    width_[v] = width_of(star);
    pattern_[v] = pattern_of(star);
  }
  layout();
  for (VertexId v = 0; v < vertices; ++v) {
    if (!contains(v)) continue;
    star.begin(mesh, stars, v);
    star.measure(mesh);
    write(v, star, stiffness);
  }
  find_alike();
  give_room(colour_, row_of_, width_, pattern_, pressure_scale_, slices_, edges_, faces_, blocks_, face_edges_,
            alike_faces_);
}

std::uint32_t TetRows::take_overflow_lane(std::uint32_t colour, Width width) {
  width = {std::bit_ceil(std::max(width.edges, puts_alike_together_ ? kLeastOverflowEdges : kLeastOverflowWidth)),
           std::bit_ceil(std::max(width.faces, puts_alike_together_ ? kLeastOverflowFaces : kLeastOverflowWidth))};
  std::vector<std::uint32_t>& open = open_[{colour, width.edges, width.faces}];
  if (open.empty()) open.push_back(add_slice(colour, width));
  const std::uint32_t s = open.back(), lane = slices_[s].count++;
  if (slices_[s].count == kLanes) open.pop_back();
  ++overflow_rows_;
  return s * kLanes + lane;
}

void TetRows::use(TetSlice& slice, Width width) {
  slice.used_edges = std::max(slice.used_edges, width.edges);
  slice.used_faces = std::max(slice.used_faces, width.faces);
}

void TetRows::copy_lane(const TetRows& from, std::uint32_t from_row, std::uint32_t to_row) {
  const TetSlice& source = from.slices_[from_row / kLanes];
  TetSlice& slice = slices_[to_row / kLanes];
  const std::uint32_t a = from_row % kLanes, b = to_row % kLanes;
  const std::uint32_t own = source.offset[a];
  slice.offset[b] = own;
  use(slice, {std::min(source.used_edges, slice.edges), std::min(source.used_faces, slice.faces)});
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
  resize_slots(pattern_, vertices, std::uint64_t{0});
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
  pattern_[v] = pattern_of(star);
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

void TetRows::compact_if_spread(double share) {
  if (overflow_rows_ > 256 && overflow_rows_ > share * rows_) compact();
}

void TetRows::renew_room() {
  sectio::renew_room(slices_, edges_, faces_, blocks_, face_edges_, alike_faces_);
}

void TetRows::compact() {
  TetRows sorted;
  sorted.puts_alike_together_ = puts_alike_together_;
  sorted.colour_ = colour_;
  sorted.width_ = width_;
  sorted.pattern_ = pattern_;
  sorted.row_of_.assign(row_of_.size(), kNone);
  sorted.colours_ = colours_;
  sorted.step_s_ = step_s_;
  sorted.pressure_scale_ = pressure_scale_;
  sorted.slices_.reserve(slices_.capacity());
  sorted.edges_.reserve(edges_.capacity());
  sorted.faces_.reserve(faces_.capacity());
  sorted.blocks_.reserve(blocks_.capacity());
  sorted.face_edges_.reserve(face_edges_.capacity());
  sorted.alike_faces_.reserve(alike_faces_.capacity());
  sorted.layout();
  for (const TetSlice& slice : sorted.slices_)
    for (std::uint32_t lane = 0; lane < slice.count; ++lane) {
      const VertexId v = vertex_at(slice.offset[lane]);
      sorted.copy_lane(*this, row_of_[v], sorted.row_of_[v]);
    }
  sorted.find_alike();
  *this = std::move(sorted);
}

void TetRows::write(VertexId v, const VertexStar& star, const TetStiffness& stiffness) {
  TetSlice& slice = slices_[row_of_[v] / kLanes];
  const std::uint32_t lane = row_of_[v] % kLanes;
  const std::span faces(faces_.data() + slice.first_face, slice.faces);
  const std::span edges(edges_.data() + slice.first_edge, slice.edges);
  TetBlockColumn* const blocks = blocks_.data() + slice.first_face;
  TetFaceEdges* const face_edges = face_edges_.data() + slice.first_face;
  use(slice, width_[v]);
  const std::uint32_t own = byte_offset(v);
  number_edges(star);
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
  slice.alike = slice.alike && is_alike(slice, lane, lane == 0 ? 1 : 0);
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
