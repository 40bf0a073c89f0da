#include "sim_server/surface/cutting/incisions.h"

#include <algorithm>
#include <map>
#include <set>

#include "sim_server/surface/cutting/templates.h"

namespace sectio {
namespace {

bool is_wall(const MeshDraft& draft, TriangleId t) {
  return t != kNone && draft.triangle(t).surface == Surface::wall;
}

// Exchanges the diagonal p q of two walls for the other one.
bool flip(MeshDraft& draft, VertexId p, VertexId q) {
  const TriangleId t = draft.triangle_of_edge(p, q), u = draft.triangle_of_edge(q, p);
  if (t == kNone || u == kNone) return false;
  const VertexId r = draft.triangle(t).before(p), s = draft.triangle(u).before(q);
  const Surface surface = draft.triangle(t).surface;
  const std::array added{Triangle{{r, p, s}, surface}, Triangle{{s, q, r}, surface}};
  return draft.replace(std::array{t, u}, added);
}

// A piece of groove whose walls are quads: rungs at both ends, and one edge of bottom between them.
struct PlainGroove {
  Lid lid;
  VertexId bottom_from = kNone, bottom_to = kNone;  // under the ends of lid.lip
};

std::optional<PlainGroove> plain_groove(const MeshDraft& draft, const Grooves& grooves, const Lip& lip) {
  const auto lid = lid_of(draft, grooves, lip);
  if (!lid) return std::nullopt;
  const PlainGroove groove{*lid, grooves.bottom_of(lip.from), grooves.bottom_of(lip.to)};
  if (groove.bottom_from == groove.bottom_to || grooves.bottom_of(lid->opposite.to) != groove.bottom_from ||
      grooves.bottom_of(lid->opposite.from) != groove.bottom_to)
    return std::nullopt;
  const auto is_quad = [&](const Lip& l, VertexId g_from, VertexId g_to) {
    const TriangleId upper = draft.triangle_of_edge(l.to, l.from), lower = draft.triangle_of_edge(g_from, g_to);
    if (!is_wall(draft, upper) || !is_wall(draft, lower)) return false;
    const VertexId x = draft.triangle(upper).before(l.to), y = draft.triangle(lower).before(g_from);
    return (x == g_from && y == l.to) || (x == g_to && y == l.from);
  };
  if (!is_quad(lip, groove.bottom_from, groove.bottom_to) ||
      !is_quad(lid->opposite, groove.bottom_to, groove.bottom_from))
    return std::nullopt;
  return groove;
}

template <class Wanted>
std::optional<PlaceOnCurve> nearest(const MeshDraft& draft, const Grooves& grooves, const Vec3& rest_body_m,
                                    double within_m, const Wanted& wanted) {
  constexpr double kLongestLip_m = 0.03;
  std::optional<PlaceOnCurve> nearest;
  double least_m = within_m;
  for (const Rung& rung : grooves.rungs) {
    const Vec3 from = draft.rest(rung.lip);
    if ((from - rest_body_m).squaredNorm() > (within_m + kLongestLip_m) * (within_m + kLongestLip_m)) continue;
    const auto lip = lip_from(draft, rung.lip);
    if (!lip) continue;
    const Vec3 edge = draft.rest(lip->to) - from;
    const double along = std::clamp(edge.dot(rest_body_m - from) / std::max(1e-30, edge.squaredNorm()), 0.0, 1.0);
    const Vec3 place = from + along * edge;
    const PlaceOnCurve on_curve{*lip, along, place, (place - rest_body_m).norm()};
    if (on_curve.distance_m >= least_m || !wanted(on_curve)) continue;
    least_m = on_curve.distance_m;
    nearest = on_curve;
  }
  return nearest;
}

}  // namespace

std::vector<VertexId> twins_of(const MeshDraft& draft, const Grooves& grooves, VertexId lip) {
  std::vector<VertexId> twins{lip};
  const VertexId bottom = grooves.bottom_of(lip);
  if (bottom == kNone) return twins;
  const Vec3 place = draft.rest(lip);
  for (const TriangleId t : draft.fan(bottom))
    for (const VertexId v : draft.triangle(t).v)
      if (v != lip && draft.rest(v) == place) twins.push_back(v);
  std::sort(twins.begin(), twins.end());
  twins.erase(std::unique(twins.begin(), twins.end()), twins.end());
  return twins;
}

std::optional<Lip> lip_from(const MeshDraft& draft, VertexId v) {
  for (const TriangleId t : draft.fan(v)) {
    const Triangle triangle = draft.triangle(t);
    if (triangle.surface == Surface::skin && is_wall(draft, draft.neighbour(t, triangle.corner_of(v))))
      return Lip{v, triangle.after(v)};
  }
  return std::nullopt;
}

std::optional<Lip> lip_to(const MeshDraft& draft, VertexId v) {
  for (const TriangleId t : draft.fan(v)) {
    const Triangle triangle = draft.triangle(t);
    if (triangle.surface == Surface::skin && is_wall(draft, draft.neighbour(t, (triangle.corner_of(v) + 2) % 3)))
      return Lip{triangle.before(v), v};
  }
  return std::nullopt;
}

std::optional<Lid> lid_of(const MeshDraft& draft, const Grooves& grooves, const Lip& lip) {
  const Vec3 from = draft.rest(lip.from);
  for (const VertexId v : twins_of(draft, grooves, lip.to))
    if (const auto opposite = lip_from(draft, v);
        opposite && opposite->to != lip.to && draft.rest(opposite->to) == from)
      return Lid{lip, *opposite};
  return std::nullopt;
}

std::vector<std::vector<VertexId>> joints_of(const MeshDraft& draft, const Grooves& grooves, VertexId lip) {
  std::vector<std::vector<VertexId>> joints;
  std::vector<VertexId> open = twins_of(draft, grooves, lip);
  if (open.size() < 3) return joints;
  while (!open.empty()) {
    // The lid of the lip that leads away from a corner leads over to the next corner.
    std::vector<VertexId> around;
    VertexId v = open.front();
    do {
      around.push_back(v);
      std::erase(open, v);
      const auto out = lip_from(draft, v);
      const auto lid = out ? lid_of(draft, grooves, *out) : std::nullopt;
      v = lid ? lid->opposite.to : kNone;
    } while (v != kNone && v != around.front() && around.size() < 16);
    if (v == kNone || around.size() < 3) continue;
    std::reverse(around.begin(), around.end());
    joints.push_back(std::move(around));
  }
  return joints;
}

Vec3 heading_at(const MeshDraft& draft, VertexId end) {
  constexpr int kMostLips = 32;
  const Vec3 at = draft.rest(end);
  Vec3 way = Vec3::Zero();
  VertexId v = end;
  for (int n = 0; n < kMostLips && way.norm() < kHeading_m; ++n) {
    const auto lip = lip_to(draft, v);
    if (!lip || lip->from == end) break;
    v = lip->from;
    way = at - draft.rest(v);
  }
  return way.stableNormalized();
}

std::optional<PlaceOnCurve> nearest_on_curves(const MeshDraft& draft, const Grooves& grooves, const Vec3& rest_body_m,
                                              double within_m) {
  return nearest(draft, grooves, rest_body_m, within_m, [](const PlaceOnCurve&) { return true; });
}

std::optional<PlaceOnCurve> nearest_on_rims(const MeshDraft& draft, const Grooves& grooves, const Vec3& rest_body_m,
                                            double within_m, const std::function<bool(const Vec3&)>& wanted) {
  return nearest(draft, grooves, rest_body_m, within_m, [&](const PlaceOnCurve& place) {
    return wanted(place.rest_body_m) && !lid_of(draft, grooves, place.lip);
  });
}

VertexId insert_rung(MeshDraft& draft, Grooves& grooves, const Lip& lip, double along) {
  const auto groove = plain_groove(draft, grooves, lip);
  if (!groove) return kNone;
  const auto [lid, g_from, g_to] = *groove;
  const VertexState here = VertexState::mix(draft.state(lip.from), draft.state(lip.to), along);
  VertexState there = VertexState::mix(draft.state(lid.opposite.to), draft.state(lid.opposite.from), along);
  there.rest_body_m = here.rest_body_m;
  const VertexState beneath = VertexState::mix(draft.state(g_from), draft.state(g_to), along);
  const VertexId n = insert_on_edge(draft, lip.from, lip.to, here);
  const VertexId s = insert_on_edge(draft, lid.opposite.from, lid.opposite.to, there);
  const VertexId g = insert_on_edge(draft, g_from, g_to, beneath);
  if (n == kNone || s == kNone || g == kNone) return kNone;
  const auto straighten = [&](const Lip& l, VertexId v, VertexId g_1, VertexId g_2) {
    if (draft.triangle_of_edge(v, g) != kNone) return true;
    return draft.triangle_of_edge(l.from, g) != kNone && draft.triangle_of_edge(v, g_2) != kNone
               ? flip(draft, l.from, g_2)
               : flip(draft, l.to, g_1);
  };
  if (!straighten(lip, n, g_from, g_to) || !straighten(lid.opposite, s, g_to, g_from)) return kNone;
  grooves.set_bottom(n, g);
  grooves.set_bottom(s, g);
  return n;
}

std::string flaw_of(const TriangleMesh& mesh, ParticleView particles, const Grooves& grooves,
                    int euler_characteristic) {
  const MeshDraft draft(mesh, particles);
  std::map<std::pair<VertexId, VertexId>, int> edges;
  std::set<VertexId> vertices;
  int faces = 0;
  const auto add = [&](std::span<const VertexId> polygon) {
    ++faces;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      vertices.insert(polygon[i]);
      ++edges[{polygon[i], polygon[(i + 1) % polygon.size()]}];
    }
  };
  for (const Triangle& t : mesh.triangles())
    if (t.alive() && t.surface == Surface::skin) add(t.v);
  std::set<std::pair<VertexId, VertexId>> covered;
  std::set<VertexId> joined;
  bool has_rim = false;
  for (const Rung& rung : grooves.rungs) {
    const auto name = "vertex " + std::to_string(rung.lip);
    if (!mesh.vertex_alive(rung.lip) || !mesh.vertex_alive(rung.bottom)) return name + ": a dead rung";
    if (draft.triangle_of_edge(rung.lip, rung.bottom) == kNone) return name + ": no edge to the bottom beneath it";
    const auto lip = lip_from(draft, rung.lip);
    if (!lip) return name + ": on no lip";
    const auto lid = lid_of(draft, grooves, *lip);
    if (!lid) {  // the lip's other side has left with an island
      has_rim = true;
      continue;
    }
    if (covered.insert({lip->from, lip->to}).second) {
      covered.insert({lid->opposite.from, lid->opposite.to});
      std::vector<VertexId> quad{lip->to, lip->from, lid->opposite.to, lid->opposite.from};
      quad.erase(std::unique(quad.begin(), quad.end()), quad.end());
      if (quad.front() == quad.back()) quad.pop_back();
      if (quad.size() > 2) add(quad);
    }
    if (joined.contains(rung.lip)) continue;
    for (const auto& joint : joints_of(draft, grooves, rung.lip)) {
      joined.insert(joint.begin(), joint.end());
      add(joint);
    }
  }
  if (has_rim) return {};
  for (const auto& [edge, times] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    if (times == 1 && back != edges.end()) continue;
    return "edge " + std::to_string(edge.first) + " - " + std::to_string(edge.second) +
           (times == 1 ? ": skin and lids leave a gap" : ": in more than two faces");
  }
  const int euler = static_cast<int>(vertices.size()) - static_cast<int>(edges.size() / 2) + faces;
  if (euler != euler_characteristic)
    return "the skin with its lids has the Euler characteristic " + std::to_string(euler);
  return {};
}

}  // namespace sectio
