#include "sim_server/cutting/contact_templates.h"

#include <algorithm>
#include <array>
#include <map>

#include "common/core/error.h"
#include "sim_server/cutting/templates.h"

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
// The text counts "four new springs" for two edges as well: those are the halves of the active edges. By Euler's
// formula three triangles with five corners have two springs within.
constexpr std::array kTemplates{
    ContactTemplate{1, 1, false, "2 left", 2, 4, 4, 1},  ContactTemplate{1, 1, true, "2 left", 1, 2, 1, 1},
    ContactTemplate{1, 0, false, "2 left", 1, 2, 1, 1},  ContactTemplate{2, 0, false, "2 right", 2, 3, 2, 2},
    ContactTemplate{2, 0, true, "2 right", 1, 2, 1, 1},  ContactTemplate{0, 1, false, "3 left", 1, 3, 3, 0},
    ContactTemplate{0, 2, false, "3 right", 2, 5, 6, 0}, ContactTemplate{0, 2, true, "3 right", 1, 3, 3, 0},
};

bool same_place(const PathPoint& a, const PathPoint& b) {
  return a.kind == b.kind && (a.kind == Kind::on_edge ? a.from == b.from && a.to == b.to : a.face == b.face);
}

VertexState state_at(const MeshDraft& draft, const PathPoint& p) {
  if (p.kind == Kind::on_edge) return VertexState::mix(draft.state(p.from), draft.state(p.to), p.t);
  return VertexState::mix({draft.state(p.face[0]), draft.state(p.face[1]), draft.state(p.face[2])}, p.bary);
}

double size_m(const MeshDraft& draft, const PathPoint& p) {
  if (p.kind == Kind::on_edge) return (draft.state(p.to).rest_body_m - draft.state(p.from).rest_body_m).norm();
  double longest = 0;
  for (std::size_t i = 0; i < 3; ++i)
    longest =
        std::max(longest, (draft.state(p.face[i]).rest_body_m - draft.state(p.face[(i + 1) % 3]).rest_body_m).norm());
  return longest;
}

// Away from corners and edges; where two fall together the first is kept. Points at vertices press on the nearest place
// beside them: original particles are not moved.
std::vector<ContactPoint> told_apart(const MeshDraft& draft, std::span<const ContactPoint> points,
                                     const ContactSettings& settings) {
  std::vector<ContactPoint> kept;
  std::vector<Vec3> at;
  for (ContactPoint p : points) {
    if (p.place.kind != Kind::on_edge && p.place.kind != Kind::in_face) continue;
    p.place.t = std::clamp(p.place.t, settings.least_ratio, 1 - settings.least_ratio);
    if (p.place.kind == Kind::in_face) {
      p.place.bary = p.place.bary.cwiseMax(settings.least_ratio);
      p.place.bary /= p.place.bary.sum();
    }
    const Vec3 x = state_at(draft, p.place).rest_body_m;
    const double least_m = settings.coincidence * size_m(draft, p.place);
    if (std::any_of(at.begin(), at.end(), [&](const Vec3& y) { return (x - y).norm() < least_m; })) continue;
    if (p.place.kind == Kind::on_edge &&
        std::any_of(kept.begin(), kept.end(), [&](const ContactPoint& k) { return same_place(k.place, p.place); }))
      continue;
    at.push_back(x);
    kept.push_back(p);
  }
  return kept;
}

// Into what has become of a face: it is whole, or divided from one edge, or by a particle within it.
VertexId insert_within(MeshDraft& draft, const PathPoint& p, std::span<const ContactPoint> made,
                       std::span<const VertexId> particles) {
  const VertexState state = state_at(draft, p);
  if (const TriangleId whole = draft.find_triangle(p.face[0], p.face[1], p.face[2]); whole != kNone)
    return insert_in_face(draft, whole, state);
  for (std::size_t k = 0; k < made.size(); ++k)
    for (std::size_t i = 0; i < 3; ++i) {
      const VertexId a = p.face[(i + 1) % 3], b = p.face[(i + 2) % 3];
      const Cell cell{particles[k], {a, b, p.face[i]}};
      const bool on_edge = made[k].place.kind == Kind::on_edge;
      if (on_edge && !triangles_of(draft, cell).empty()) return insert_in_cell(draft, cell, state);
      if (on_edge || made[k].place.face != p.face) continue;
      // The third of the face that is opposite to its corner i, if the point lies in it.
      const Vec3 &q = made[k].place.bary, ratio = p.bary.cwiseQuotient(q);
      if (ratio.minCoeff() < ratio[static_cast<int>(i)]) continue;
      const TriangleId t = draft.find_triangle(particles[k], a, b);
      if (t != kNone) return insert_in_face(draft, t, state);
    }
  return kNone;
}

bool make(MeshDraft& draft, TemporaryContact& contact) {
  contact.particles.clear();
  for (const bool edges : {true, false})  // edges first: a face is divided from them
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

std::optional<MeshDraft> without(const MeshDraft& draft, const TemporaryContact& contact) {
  MeshDraft original = draft;
  if (contact.inverse && !original.undo(*contact.inverse)) return std::nullopt;
  return original;
}

Press press(MeshDraft& draft, TemporaryContact& contact, std::span<const ContactPoint> points,
            const ContactSettings& settings) {
  std::optional<MeshDraft> original = without(draft, contact);
  if (!original) return {ContactChange::refused, {}};
  TemporaryContact next;
  next.points = told_apart(*original, points, settings);
  // In the order in which particles are made.
  std::stable_partition(next.points.begin(), next.points.end(),
                        [](const ContactPoint& p) { return p.place.kind == Kind::on_edge; });
  const bool same = contact.inverse && std::equal(contact.points.begin(), contact.points.end(), next.points.begin(),
                                                  next.points.end(), [](const ContactPoint& a, const ContactPoint& b) {
                                                    return same_place(a.place, b.place);
                                                  });
  Press result;
  if (same) {
    for (std::size_t i = 0; i < next.points.size(); ++i) {
      VertexState state = draft.state(contact.particles[i]);
      state.rest_body_m = state_at(*original, next.points[i].place).rest_body_m;
      state.position_world_m = next.points[i].target_world_m;
      draft.move_vertex(contact.particles[i], state);
    }
    contact.points = std::move(next.points);
  } else {
    result.change = ContactChange::exchanged;
    original->mark();
    if (!make(*original, next)) return {ContactChange::refused, {}};
    next.inverse = original->inverse_since_mark();
    for (std::size_t i = 0; i < next.points.size(); ++i) {
      VertexState state = original->state(next.particles[i]);
      state.position_world_m = next.points[i].target_world_m;
      original->move_vertex(next.particles[i], state);
    }
    draft = std::move(*original);
    contact = std::move(next);
    if (contact.points.empty()) contact.inverse.reset();
  }
  for (std::size_t i = 0; i < contact.particles.size(); ++i)
    result.held.push_back({contact.particles[i], contact.points[i].target_world_m});
  return result;
}

bool release(MeshDraft& draft, TemporaryContact& contact) {
  const bool undone = !contact.inverse || draft.undo(*contact.inverse);
  contact = {};
  return undone;
}

}  // namespace sectio
