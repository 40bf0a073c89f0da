#include "sim_server/volume/tets/front_rollback.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "common/core/sort_unique.h"

namespace sectio {
namespace {

constexpr double kWithin = 0.25;   // ratio of the way from a vertex to the middle of the element whose side counts
constexpr double kBeside = -0.25;  // least barycentric weight in a piece that a vertex counts as nearly in

}  // namespace

FrontRollback::FrontRollback(TetTopology& draft, const TetDelta* front) : draft_(draft), front_(front) {
  if (!front_) return;
  before_ = change_of(*front_);
  for (std::size_t k = 0; k < before_.tetrahedra.size(); ++k) {
    const TetEdit& e = before_.tetrahedra[k];
    piece_of_.emplace_back(e.origin, static_cast<std::uint32_t>(k));
    for (const VertexId v : e.after)
      if (const auto [state, is_new] = corner_.insert(v); is_new) state = draft_.vertex(v);
  }
  std::ranges::sort(piece_of_);
  std::unordered_map<VertexId, TetVertexState> joined;  // vertices with a twin, and twins that had a twin
  const auto state = [&](VertexId v) -> TetVertexState& {
    return joined.try_emplace(v, draft_.vertex(v)).first->second;
  };
  for (const auto& [v, twin, share] : front_->joins) {
    const TetVertexState other = state(twin);
    TetVertexState& kept = state(v);
    kept.position_world_m += share * (other.position_world_m - kept.position_world_m);
    kept.velocity_m_per_s += share * (other.velocity_m_per_s - kept.velocity_m_per_s);
  }
  apply(inverse(*front_), draft_);
  for (const auto& [v, twin, share] : front_->joins)
    if (const TetVertexState& s = joined.at(v); v < draft_.vertex_count())
      draft_.set_state(v, s.position_world_m, s.velocity_m_per_s);
}

Vec3 FrontRollback::middle(std::uint32_t t) const {
  Vec3 sum = Vec3::Zero();
  for (const VertexId v : draft_.tetrahedra()[t]) sum += 0.25 * draft_.vertex(v).rest_body_m;
  return sum;
}

std::array<double, 4> FrontRollback::weights(const Piece& piece, const Vec3& at) {
  const auto x = [&](std::size_t k) -> const Vec3& { return piece.corner[k]->rest_body_m; };
  const double whole = tet_volume_m3(x(0), x(1), x(2), x(3));
  return {tet_volume_m3(at, x(1), x(2), x(3)) / whole, tet_volume_m3(x(0), at, x(2), x(3)) / whole,
          tet_volume_m3(x(0), x(1), at, x(3)) / whole, tet_volume_m3(x(0), x(1), x(2), at) / whole};
}

// Empty where the front had changed nothing.
std::vector<FrontRollback::Piece> FrontRollback::pieces_of(std::uint32_t origin) const {
  std::vector<Piece> pieces;
  const auto first = std::ranges::lower_bound(piece_of_, origin, {}, [](const auto& p) { return p.first; });
  for (auto of_origin = first; of_origin != piece_of_.end() && of_origin->first == origin; ++of_origin) {
    const TetEdit& e = before_.tetrahedra[of_origin->second];
    Piece piece{e.id, {}};
    for (std::size_t i = 0; i < 4; ++i) piece.corner[i] = corner_.find(e.after[i]);
    pieces.push_back(piece);
  }
  return pieces;
}

// From the piece that the vertex lies in, on its side of the front's opening: `within_body_m` is a point inside the
// element of the vertex.
TetVertexState FrontRollback::state_at(const std::vector<Piece>& pieces, const Vec3& rest_body_m,
                                       const Vec3& within_body_m) const {
  const auto least = [](const std::array<double, 4>& w) { return *std::ranges::min_element(w); };
  const Piece* best = nullptr;
  double most = -HUGE_VAL;
  for (const Piece& piece : pieces) {
    const double beside = std::min(0.0, least(weights(piece, rest_body_m)) - kBeside);
    // Pieces that contain the vertex, or nearly do, come before all others.
    const double score = beside < 0 ? beside - 1e6 : std::max(-1e5, least(weights(piece, within_body_m)));
    if (best && !(score > most)) continue;
    best = &piece;
    most = score;
  }
  for (const TetVertexState* corner : best->corner)
    if (corner->rest_body_m == rest_body_m) return *corner;
  const std::array<double, 4> w = weights(*best, rest_body_m);
  TetVertexState state;
  state.rest_body_m = rest_body_m;
  for (std::size_t i = 0; i < 4; ++i) {
    state.position_world_m += w[i] * best->corner[i]->position_world_m;
    state.velocity_m_per_s += w[i] * best->corner[i]->velocity_m_per_s;
  }
  return state;
}

std::vector<VertexId> FrontRollback::give_states() {
  if (empty()) return {};
  const TetChange now = draft_.change();
  struct Largest {
    std::uint32_t t = kNone, origin = kNone;
    double volume_m3 = 0;
  };
  NumberTable<Largest> largest;  // by vertex
  for (const TetEdit& e : now.tetrahedra) {
    const double volume_m3 = draft_.volume_m3(e.id);
    for (const VertexId v : e.after)
      if (Largest& l = largest.at(v); volume_m3 > l.volume_m3) l = {e.id, e.origin, volume_m3};
  }
  // New vertices, and those that have a twin now. A vertex that only had a twin before stays where the rollback put it.
  std::vector<VertexId> vertices;
  for (auto v = now.first_added; v < draft_.vertex_count(); ++v)
    if (const auto [a, b] = *draft_.made_from(v); a == b && a < now.first_added) vertices.push_back(a);
  sort_unique(vertices);
  for (auto v = now.first_added; v < draft_.vertex_count(); ++v) vertices.push_back(v);
  std::vector<TetVertexState> states;
  for (const VertexId v : vertices) {
    const Largest& l = largest.at(v);
    const TetVertexState own = draft_.vertex(v);
    const std::vector<Piece> pieces = pieces_of(l.origin);
    const Vec3 within = own.rest_body_m + kWithin * (middle(l.t) - own.rest_body_m);
    states.push_back(pieces.empty() ? own : state_at(pieces, own.rest_body_m, within));
  }
  for (std::size_t k = 0; k < vertices.size(); ++k)
    draft_.set_state(vertices[k], states[k].position_world_m, states[k].velocity_m_per_s);
  for (const TetDelta::Join& join : front_->joins)
    if (join.v < now.first_added) vertices.push_back(join.v);
  sort_unique(vertices);
  return vertices;
}

void FrontRollback::find_origins(TetChange& change) const {
  if (empty()) return;
  std::unordered_map<std::uint32_t, std::uint32_t> whole_of;  // by tetrahedron now; asked, never walked
  for (const TetEdit& e : draft_.change().tetrahedra) whole_of[e.id] = e.origin;
  for (TetEdit& e : change.tetrahedra) {
    if (e.after == kNoTetrahedron) continue;
    const auto of = whole_of.find(e.id);
    const std::uint32_t whole = of == whole_of.end() ? e.id : of->second;
    const Vec3 at = middle(e.id);
    e.origin = whole;
    double most = -HUGE_VAL;
    for (const Piece& piece : pieces_of(whole)) {
      const std::array<double, 4> w = weights(piece, at);
      if (const double least = *std::ranges::min_element(w); least > most) {
        most = least;
        e.origin = piece.id;
      }
    }
  }
}

}  // namespace sectio
