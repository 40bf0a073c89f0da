#include "sim_server/volume/tets/taken_back.h"

#include <algorithm>
#include <cmath>

#include "common/core/sort_unique.h"

namespace sectio {
namespace {

constexpr double kWithin = 0.25;   // of the way to the middle of an element, whose side counts
constexpr double kBeside = -0.25;  // least weight of a piece that a vertex may be a little beside

// Settled vertices that get a twin, ascending.
std::vector<VertexId> parted(std::span<const TetStep> steps, VertexId first_made) {
  std::vector<VertexId> vertices;
  for (const TetStep& step : steps)
    if (step.b == kNone && step.a < first_made) vertices.push_back(step.a);
  sort_unique(vertices);
  return vertices;
}

}  // namespace

TakenBack::TakenBack(TetTopology& volume) : before_(volume.change()) {
  for (std::size_t k = 0; k < before_.tetrahedra.size(); ++k) {
    const TetEdit& e = before_.tetrahedra[k];
    pieces_of_[e.origin].push_back(static_cast<std::uint32_t>(k));
    for (const VertexId v : e.after) corner_.try_emplace(v, volume.vertex(v));
  }
  steps_ = volume.take_back();
}

void TakenBack::restore(TetTopology& volume) const {
  volume.undo_to(0);
  volume.redo(steps_);
}

Vec3 TakenBack::middle(const TetTopology& volume, std::uint32_t t) {
  Vec3 sum = Vec3::Zero();
  for (const VertexId v : volume.tetrahedra()[t]) sum += 0.25 * volume.vertex(v).rest_body_m;
  return sum;
}

std::array<double, 4> TakenBack::weights(const Piece& piece, const Vec3& at) {
  const auto x = [&](std::size_t k) -> const Vec3& { return piece.corner[k]->rest_body_m; };
  const double whole = tet_volume_m3(x(0), x(1), x(2), x(3));
  return {tet_volume_m3(at, x(1), x(2), x(3)) / whole, tet_volume_m3(x(0), at, x(2), x(3)) / whole,
          tet_volume_m3(x(0), x(1), at, x(3)) / whole, tet_volume_m3(x(0), x(1), x(2), at) / whole};
}

// Empty where nothing temporary was.
std::vector<TakenBack::Piece> TakenBack::pieces_of(std::uint32_t origin) const {
  std::vector<Piece> pieces;
  const auto found = pieces_of_.find(origin);
  if (found == pieces_of_.end()) return pieces;
  for (const std::uint32_t k : found->second) {
    const TetEdit& e = before_.tetrahedra[k];
    Piece piece{e.id, {}};
    for (std::size_t i = 0; i < 4; ++i) piece.corner[i] = &corner_.at(e.after[i]);
    pieces.push_back(piece);
  }
  return pieces;
}

// In the piece in which the vertex is, on that side of what was open: `within` is a point of its element.
TetVertexState TakenBack::state_at(const std::vector<Piece>& pieces, const Vec3& rest_body_m,
                                   const Vec3& within_body_m) const {
  const auto least = [](const std::array<double, 4>& w) { return *std::ranges::min_element(w); };
  const Piece* best = nullptr;
  double most = -HUGE_VAL;
  for (const Piece& piece : pieces) {
    const double beside = std::min(0.0, least(weights(piece, rest_body_m)) - kBeside);
    // Any that the vertex is in or nearly in comes before any that it is not.
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

std::vector<VertexId> TakenBack::give_states(TetTopology& volume) const {
  if (empty()) return {};
  const TetChange now = volume.change();
  struct Largest {
    std::uint32_t t = kNone, origin = kNone;
    double volume_m3 = 0;
  };
  std::unordered_map<VertexId, Largest> largest;  // asked, never walked
  for (const TetEdit& e : now.tetrahedra) {
    const double volume_m3 = volume.volume_m3(e.id);
    for (const VertexId v : e.after)
      if (Largest& l = largest[v]; volume_m3 > l.volume_m3) l = {e.id, e.origin, volume_m3};
  }
  // New ones, and those that have a twin; one that only had one stays where it was put.
  std::vector<VertexId> vertices = parted(volume.steps(), now.first_added);
  for (auto v = now.first_added; v < volume.vertex_count(); ++v) vertices.push_back(v);
  std::vector<TetVertexState> states;
  for (const VertexId v : vertices) {
    const Largest& l = largest.at(v);
    const TetVertexState own = volume.vertex(v);
    const std::vector<Piece> pieces = pieces_of(l.origin);
    const Vec3 within = own.rest_body_m + kWithin * (middle(volume, l.t) - own.rest_body_m);
    states.push_back(pieces.empty() ? own : state_at(pieces, own.rest_body_m, within));
  }
  for (std::size_t k = 0; k < vertices.size(); ++k)
    volume.set_state(vertices[k], states[k].position_world_m, states[k].velocity_m_per_s);
  const std::vector<VertexId> before = parted(steps_, now.first_added);
  vertices.insert(vertices.end(), before.begin(), before.end());
  sort_unique(vertices);
  return vertices;
}

void TakenBack::find_origins(const TetTopology& volume, TetChange& change) const {
  if (empty()) return;
  std::unordered_map<std::uint32_t, std::uint32_t> settled;  // by tetrahedron now; asked, never walked
  for (const TetEdit& e : volume.change().tetrahedra) settled[e.id] = e.origin;
  for (TetEdit& e : change.tetrahedra) {
    if (e.after == kNoTetrahedron) continue;
    const auto of = settled.find(e.id);
    const std::uint32_t whole = of == settled.end() ? e.id : of->second;
    const Vec3 at = middle(volume, e.id);
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
