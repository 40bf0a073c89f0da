#include "sim_server/surface/indentation/contact_templates.h"

#include <algorithm>
#include <array>
#include <map>

#include "common/core/error.h"
#include "sim_server/surface/cutting/templates.h"

namespace sectio {
namespace {

using Kind = PathPoint::Kind;

//     one edge           two edges          no edge, one        no edge, two
//        A                  A                  A                   A         .
//      / | \              / | \              / | \               / | \       .
//     /  K  \            e--+--f            /  K  \             / K-L \      .
//    / / | \ \          /  \    \          / /   \ \           / /  \\ \     .
//   B----e----C        B---------C        B---------C         B---------C    .
//
// For two edges the paper's text counts "four new springs", which are the halves of the active edges: by Euler's
// formula, three triangles with five corners have two springs within.
constexpr std::array kTemplates{
    ContactTemplate{1, 1, false, "2 left", 2, 4, 4, 1},  ContactTemplate{1, 1, true, "2 left", 1, 2, 1, 1},
    ContactTemplate{1, 0, false, "2 left", 1, 2, 1, 1},  ContactTemplate{2, 0, false, "2 right", 2, 3, 2, 2},
    ContactTemplate{2, 0, true, "2 right", 1, 2, 1, 1},  ContactTemplate{0, 1, false, "3 left", 1, 3, 3, 0},
    ContactTemplate{0, 2, false, "3 right", 2, 5, 6, 0}, ContactTemplate{0, 2, true, "3 right", 1, 3, 3, 0},
};

bool same_place(const PathPoint& a, const PathPoint& b) {
  return a.kind == b.kind && (a.kind == Kind::on_edge ? a.from == b.from && a.to == b.to : a.face == b.face);
}

double size_m(const MeshDraft& draft, const PathPoint& p) {
  if (p.kind == Kind::on_edge) return (draft.state(p.to).rest_body_m - draft.state(p.from).rest_body_m).norm();
  double longest = 0;
  for (std::size_t i = 0; i < 3; ++i)
    longest =
        std::max(longest, (draft.state(p.face[i]).rest_body_m - draft.state(p.face[(i + 1) % 3]).rest_body_m).norm());
  return longest;
}

bool exists(const MeshDraft& draft, const PathPoint& p) {
  if (p.kind == Kind::on_edge) return draft.triangle_of_edge(p.from, p.to) != kNone;
  return p.kind == Kind::in_face && draft.find_triangle(p.face[0], p.face[1], p.face[2]) != kNone;
}

// Writes each place in one way, away from corners and edges. Points at vertices press on the nearest place beside them,
// because original particles are not moved.
void tidy(PathPoint& p, double least_ratio) {
  if (p.kind == Kind::on_edge) {
    p.t = std::clamp(p.t, least_ratio, 1 - least_ratio);
    if (p.from < p.to) return;
    std::swap(p.from, p.to);
    p.t = 1 - p.t;
    return;
  }
  p.bary = p.bary.cwiseMax(least_ratio);
  p.bary /= p.bary.sum();
  const auto first = std::min_element(p.face.begin(), p.face.end()) - p.face.begin();
  std::rotate(p.face.begin(), p.face.begin() + first, p.face.end());
  p.bary = Vec3(p.bary[static_cast<int>(first)], p.bary[static_cast<int>((first + 1) % 3)],
                p.bary[static_cast<int>((first + 2) % 3)]);
}

// A place in the face beside an edge, close to a point of the edge: for a second instrument on the edge.
PathPoint beside_edge(const MeshDraft& draft, const PathPoint& p, double ratio) {
  PathPoint q;
  q.kind = Kind::in_face;
  q.face = draft.triangle(draft.triangle_of_edge(p.from, p.to)).v;
  for (int i = 0; i < 3; ++i) {
    const VertexId corner = q.face[static_cast<std::size_t>(i)];
    q.bary[i] = corner == p.from ? (1 - ratio) * (1 - p.t) : corner == p.to ? (1 - ratio) * p.t : ratio;
  }
  tidy(q, ratio);
  return q;
}

struct Sorted {
  std::vector<ContactPoint> points;      // in the order in which particles are made: those on edges first
  std::vector<std::size_t> particle_of;  // by requested point: number of its particle; kNone: skipped
};

// Keeps the first of two places that coincide; an edge has one particle.
Sorted told_apart(const MeshDraft& draft, std::span<const ContactPoint> points, const PressSettings& settings) {
  std::vector<ContactPoint> kept;
  std::vector<Vec3> at;
  Sorted sorted;
  for (ContactPoint p : points) {
    sorted.particle_of.push_back(kNone);
    if (!exists(draft, p.place)) continue;
    tidy(p.place, settings.least_ratio);
    const Vec3 x = state_at(draft, p.place).rest_body_m;
    const double least_m = settings.coincidence * size_m(draft, p.place);
    std::size_t k = 0;
    const auto on_one_edge = [&](const ContactPoint& other) {
      return p.place.kind == Kind::on_edge && same_place(other.place, p.place);
    };
    while (k < kept.size() && (x - at[k]).norm() >= least_m && !(on_one_edge(kept[k]) && kept[k].owner == p.owner)) ++k;
    sorted.particle_of.back() = k;
    if (k < kept.size()) continue;
    if (std::ranges::any_of(kept, on_one_edge)) p.place = beside_edge(draft, p.place, settings.least_ratio);
    at.push_back(x);
    kept.push_back(p);
  }
  std::vector<std::size_t> index(kept.size());
  for (const bool edges : {true, false})
    for (std::size_t k = 0; k < kept.size(); ++k) {
      if ((kept[k].place.kind == Kind::on_edge) != edges) continue;
      index[k] = sorted.points.size();
      sorted.points.push_back(kept[k]);
    }
  for (std::size_t& k : sorted.particle_of)
    if (k != kNone) k = index[k];
  return sorted;
}

// The place of a particle in a face; nothing if it is neither in the face nor on its rim.
std::optional<Vec3> bary_in(const std::array<VertexId, 3>& face, const PathPoint& p) {
  if (p.kind == Kind::in_face) return p.face == face ? std::optional(p.bary) : std::nullopt;
  Vec3 bary = Vec3::Zero();
  for (int i = 0; i < 3; ++i) {
    const VertexId corner = face[static_cast<std::size_t>(i)];
    if (corner == p.from) bary[i] = 1 - p.t;
    if (corner == p.to) bary[i] = p.t;
  }
  return bary.sum() > 0.999 ? std::optional(bary) : std::nullopt;
}

// The triangle of a divided face that holds a point of the face.
struct Piece {
  TriangleId triangle = kNone;
  Vec3 bary = Vec3::Zero();
};
Piece piece_at(const MeshDraft& draft, const PathPoint& p, std::span<const ContactPoint> made,
               std::span<const VertexId> particles) {
  std::map<VertexId, Vec3> inside;
  for (int i = 0; i < 3; ++i) inside[p.face[static_cast<std::size_t>(i)]] = Vec3::Unit(i);
  for (std::size_t k = 0; k < made.size(); ++k)
    if (const auto bary = bary_in(p.face, made[k].place)) inside[particles[k]] = *bary;
  Piece best;
  double most = -1e9;
  for (const auto& [v, bary] : inside)
    for (const TriangleId t : draft.fan(v)) {
      const Triangle piece = draft.triangle(t);
      if (!std::ranges::all_of(piece.v, [&](VertexId x) { return inside.contains(x); })) continue;
      Mat3 corners;
      for (int i = 0; i < 3; ++i) corners.col(i) = inside.at(piece.v[static_cast<std::size_t>(i)]);
      const double area = corners.determinant();
      if (area < 1e-9) continue;
      // The barycentric coordinates of p in the piece: areas of p with each side, over the whole.
      Vec3 in_piece;
      for (int i = 0; i < 3; ++i) {
        Mat3 part = corners;
        part.col(i) = p.bary;
        in_piece[i] = part.determinant() / area;
      }
      if (in_piece.minCoeff() <= most) continue;
      most = in_piece.minCoeff();
      best = {t, in_piece};
    }
  return best;
}

// Inserts the particle of figure 2, joined to four vertices, in a face divided from one edge; in any other that of
// figure 3.
VertexId insert_within(MeshDraft& draft, const PathPoint& p, std::span<const ContactPoint> made,
                       std::span<const VertexId> particles) {
  const VertexState state = state_at(draft, p);
  for (std::size_t k = 0; k < made.size(); ++k)
    for (std::size_t i = 0; i < 3; ++i) {
      const Cell cell{particles[k], {p.face[(i + 1) % 3], p.face[(i + 2) % 3], p.face[i]}};
      if (made[k].place.kind == Kind::on_edge && !triangles_of(draft, cell).empty())
        return insert_in_cell(draft, cell, state);
    }
  const TriangleId piece = piece_at(draft, p, made, particles).triangle;
  return piece != kNone ? insert_in_face(draft, piece, state) : kNone;
}

bool make(MeshDraft& draft, TemporaryContact& contact) {
  contact.particles.clear();
  for (const bool edges : {true, false})  // edges first, as they divide their faces
    for (std::size_t i = 0; i < contact.points.size(); ++i) {
      const PathPoint& p = contact.points[i].place;
      if ((p.kind == Kind::on_edge) != edges) continue;
      const VertexId v =
          edges ? insert_on_edge(draft, p.from, p.to, state_at(draft, p))
                : insert_within(draft, p, {contact.points.data(), contact.particles.size()}, contact.particles);
      if (v == kNone) return false;
      contact.particles.push_back(v);
    }
  return true;
}

}  // namespace

std::span<const ContactTemplate> contact_templates() {
  return kTemplates;
}

const ContactTemplate& contact_template_for(int active_edges, int vertices_inside, bool coincident) {
  const auto it = std::find_if(kTemplates.begin(), kTemplates.end(), [&](const ContactTemplate& t) {
    return t.active_edges == active_edges && t.vertices_inside == vertices_inside && t.coincident == coincident;
  });
  SECTIO_ASSERT(it != kTemplates.end(), "a template for every face that is touched");
  return *it;
}

VertexState state_at(const MeshDraft& original, const PathPoint& p) {
  if (p.kind == Kind::on_edge) return VertexState::mix(original.state(p.from), original.state(p.to), p.t);
  return VertexState::mix({original.state(p.face[0]), original.state(p.face[1]), original.state(p.face[2])}, p.bary);
}

std::optional<MeshDraft> without(const MeshDraft& draft, const TemporaryContact& contact) {
  MeshDraft original = draft;
  if (contact.inverse && !original.undo(*contact.inverse)) return std::nullopt;
  return original;
}

namespace {

// Displaces a particle that is pushed; it is then held during the step and has no velocity of its own.
void displace(VertexState& state, const ContactPoint& p) {
  if (!p.presses || (state.position_world_m - p.target_world_m).dot(p.normal_world) < 0) return;
  state.position_world_m = p.target_world_m;
  state.velocity_world_m_per_s.setZero();
}

bool slid(const MeshDraft& original, const PathPoint& before, const PathPoint& now, double least_move) {
  const double by_m = (state_at(original, before).rest_body_m - state_at(original, now).rest_body_m).norm();
  return by_m >= least_move * size_m(original, now);
}

void follow(MeshDraft& draft, const MeshDraft& original, TemporaryContact& contact, std::vector<ContactPoint> points,
            const PressSettings& settings) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    VertexState state = draft.state(contact.particles[i]);
    if (slid(original, contact.points[i].place, points[i].place, settings.least_move))
      state.rest_body_m = state_at(original, points[i].place).rest_body_m;
    else
      points[i].place = contact.points[i].place;
    displace(state, points[i]);
    draft.move_vertex(contact.particles[i], state);
  }
  contact.points = std::move(points);
}

// The state of a place of the original surface, on the surface with temporary elements.
VertexState state_on(const MeshDraft& now, const TemporaryContact& contact, PathPoint p) {
  tidy(p, 0);
  if (p.kind == Kind::on_edge) {
    for (std::size_t k = 0; k < contact.points.size(); ++k) {
      const PathPoint& on = contact.points[k].place;
      if (!same_place(on, p)) continue;
      const VertexState middle = now.state(contact.particles[k]);
      return p.t < on.t ? VertexState::mix(now.state(p.from), middle, p.t / on.t)
                        : VertexState::mix(middle, now.state(p.to), (p.t - on.t) / (1 - on.t));
    }
    return state_at(now, p);
  }
  const Piece piece = piece_at(now, p, contact.points, contact.particles);
  if (piece.triangle == kNone) return state_at(now, p);
  const auto& v = now.triangle(piece.triangle).v;
  return VertexState::mix({now.state(v[0]), now.state(v[1]), now.state(v[2])}, piece.bary);
}

// Makes the templates anew from the original. A particle that stays keeps its state; others begin on the surface.
bool exchange(const MeshDraft& before, MeshDraft& original, TemporaryContact& contact,
              std::vector<ContactPoint> points) {
  TemporaryContact next;
  next.points = std::move(points);
  original.mark();
  if (!make(original, next)) return false;
  next.inverse = original.inverse_since_mark();
  for (std::size_t i = 0; i < next.points.size(); ++i) {
    VertexState state = original.state(next.particles[i]);
    VertexState now = state_on(before, contact, next.points[i].place);
    for (std::size_t k = 0; k < contact.points.size(); ++k)
      if (same_place(contact.points[k].place, next.points[i].place)) now = before.state(contact.particles[k]);
    state.position_world_m = now.position_world_m;
    state.velocity_world_m_per_s = now.velocity_world_m_per_s;
    displace(state, next.points[i]);
    original.move_vertex(next.particles[i], state);
  }
  if (next.points.empty()) next.inverse.reset();
  contact = std::move(next);
  return true;
}

}  // namespace

Press press(MeshDraft& draft, TemporaryContact& contact, std::span<const ContactPoint> points,
            const PressSettings& settings) {
  std::optional<MeshDraft> original = without(draft, contact);
  if (!original) return {ContactChange::refused, {}};
  Sorted next = told_apart(*original, points, settings);
  const auto same = [](const ContactPoint& a, const ContactPoint& b) { return same_place(a.place, b.place); };
  Press result;
  if (std::equal(contact.points.begin(), contact.points.end(), next.points.begin(), next.points.end(), same)) {
    follow(draft, *original, contact, std::move(next.points), settings);
  } else {
    if (!exchange(draft, *original, contact, std::move(next.points))) return {ContactChange::refused, {}};
    result.change = ContactChange::exchanged;
    draft = std::move(*original);
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].presses || next.particle_of[i] == kNone) continue;
    const HeldParticle held{contact.particles[next.particle_of[i]], points[i].target_world_m, points[i].owner};
    const bool known = std::ranges::any_of(
        result.held, [&](const HeldParticle& h) { return h.vertex == held.vertex && h.owner == held.owner; });
    if (!known) result.held.push_back(held);
  }
  return result;
}

bool release(MeshDraft& draft, TemporaryContact& contact) {
  const bool undone = !contact.inverse || draft.undo(*contact.inverse);
  contact = {};
  return undone;
}

}  // namespace sectio
