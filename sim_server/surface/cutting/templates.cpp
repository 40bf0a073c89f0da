#include "sim_server/surface/cutting/templates.h"

#include <algorithm>

namespace sectio {
namespace {

constexpr Triangle wall(VertexId a, VertexId b, VertexId c) {
  return {{a, b, c}, Surface::wall};
}

Triangle with(Triangle t, VertexId old_vertex, VertexId new_vertex) {
  std::replace(t.v.begin(), t.v.end(), old_vertex, new_vertex);
  return t;
}

// Opens the path a - v - b: the right side gets `twin` in place of v, and `fill` closes the hole a, twin, b, v.
bool unzip(MeshDraft& draft, VertexId a, VertexId v, VertexId b, VertexId twin, std::span<const Triangle> fill) {
  const std::vector<TriangleId> right = right_of_path(draft, a, v, b);
  if (right.empty()) return false;
  std::vector<Triangle> added;
  added.reserve(right.size() + fill.size());
  for (const TriangleId t : right) added.push_back(with(draft.triangle(t), v, twin));
  added.insert(added.end(), fill.begin(), fill.end());
  return draft.replace(right, added);
}

}  // namespace

std::vector<TriangleId> right_of_path(const MeshDraft& draft, VertexId a, VertexId v, VertexId b) {
  std::vector<TriangleId> fan = draft.fan(v);
  const auto first =
      std::find_if(fan.begin(), fan.end(), [&](TriangleId t) { return draft.triangle(t).after(v) == a; });
  if (first == fan.end()) return {};
  std::rotate(fan.begin(), first, fan.end());
  const auto last =
      std::find_if(fan.begin(), fan.end(), [&](TriangleId t) { return draft.triangle(t).before(v) == b; });
  if (last == fan.end()) return {};
  fan.erase(last + 1, fan.end());
  return fan;
}

std::vector<TriangleId> triangles_of(const MeshDraft& draft, const Cell& cell) {
  std::vector<TriangleId> result;
  for (std::size_t i = 0; i + 1 < cell.rim.size(); ++i) {
    const TriangleId t = draft.find_triangle(cell.apex, cell.rim[i], cell.rim[i + 1]);
    if (t == kNone) return {};
    result.push_back(t);
  }
  return result;
}

VertexId insert_in_face(MeshDraft& draft, TriangleId t, const VertexState& state) {
  const Triangle old = draft.triangle(t);
  const VertexId n = draft.add_vertex(state);
  const std::array added{with(old, old.v[0], n), with(old, old.v[1], n), with(old, old.v[2], n)};
  return draft.replace(std::array{t}, added) ? n : kNone;
}

VertexId insert_on_edge(MeshDraft& draft, VertexId from, VertexId to, const VertexState& state) {
  const TriangleId t = draft.triangle_of_edge(from, to);
  const TriangleId u = draft.triangle_of_edge(to, from);
  if (t == kNone || u == kNone) return kNone;
  const Triangle old_t = draft.triangle(t), old_u = draft.triangle(u);
  const VertexId n = draft.add_vertex(state);
  const std::array added{with(old_t, to, n), with(old_u, to, n), with(old_t, from, n), with(old_u, from, n)};
  return draft.replace(std::array{t, u}, added) ? n : kNone;
}

VertexId insert_in_cell(MeshDraft& draft, const Cell& cell, const VertexState& state) {
  const std::vector<TriangleId> removed = triangles_of(draft, cell);
  if (removed.empty()) return kNone;
  const Surface surface = draft.triangle(removed.front()).surface;
  const VertexId n = draft.add_vertex(state);
  std::vector<Triangle> added;
  for (std::size_t i = 0; i + 1 < cell.rim.size(); ++i) added.push_back({{n, cell.rim[i], cell.rim[i + 1]}, surface});
  added.push_back({{n, cell.rim.back(), cell.apex}, surface});
  added.push_back({{n, cell.apex, cell.rim.front()}, surface});
  return draft.replace(removed, added) ? n : kNone;
}

std::optional<Opening> open_start(MeshDraft& draft, VertexId start, VertexId middle, VertexId tip,
                                  const std::array<VertexState, 3>& bottom) {
  Opening o;
  o.twin = draft.add_vertex(draft.state(middle));
  for (std::size_t i = 0; i < 3; ++i) o.bottom[i] = draft.add_vertex(bottom[i]);
  const auto [g0, g1, g2] = o.bottom;
  const std::array fill{wall(start, o.twin, g0), wall(g0, o.twin, g1),  // right, start to middle
                        wall(o.twin, tip, g2),   wall(o.twin, g2, g1),  // right, middle to tip
                        wall(tip, middle, g2),   wall(middle, g1, g2),  // left, tip to middle
                        wall(middle, start, g0), wall(middle, g0, g1)};
  if (!unzip(draft, start, middle, tip, o.twin, fill)) return std::nullopt;
  return o;
}

std::optional<Extension> extend(MeshDraft& draft, VertexId tip, VertexId tip_bottom, VertexId next,
                                const VertexState& bottom) {
  Extension e;
  e.twin = draft.add_vertex(draft.state(tip));
  e.bottom = draft.add_vertex(bottom);
  const std::array fill{wall(tip_bottom, e.twin, e.bottom), wall(e.twin, next, e.bottom), wall(next, tip, e.bottom),
                        wall(tip, tip_bottom, e.bottom)};
  if (!unzip(draft, tip_bottom, tip, next, e.twin, fill)) return std::nullopt;
  return e;
}

VertexId join_grooves(MeshDraft& draft, VertexId v, VertexId bottom_a, VertexId bottom_b) {
  const VertexId twin = draft.add_vertex(draft.state(v));
  const std::array fill{wall(bottom_a, twin, bottom_b), wall(bottom_b, v, bottom_a)};
  return unzip(draft, bottom_a, v, bottom_b, twin, fill) ? twin : kNone;
}

}  // namespace sectio
