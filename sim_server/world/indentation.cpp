#include "sim_server/world/indentation.h"

#include <algorithm>
#include <utility>

#include "common/core/error.h"

namespace sectio {
namespace {

// A particle that was let go counts as back when it has been slower than this against its face for so long; a vibration
// of 10 Hz is then below 0.01 mm.
constexpr double kStill_m_per_s = 5e-4;
constexpr double kStill_s = 0.02;

bool moves(const MeshDraft& now, const MeshDraft& original, const TemporaryContact& contact, std::size_t i) {
  const Vec3 of_face = state_at(original, contact.points[i].place).velocity_world_m_per_s;
  return (now.state(contact.particles[i]).velocity_world_m_per_s - of_face).norm() > kStill_m_per_s;
}

bool presses(std::span<const ContactPoint> points, std::uint32_t owner) {
  return std::ranges::any_of(points, [&](const ContactPoint& p) { return p.owner == owner; });
}

// The contacts that were let go and are not back yet.
std::vector<ContactPoint> not_back_yet(const Body& body, std::span<const ContactPoint> pressed) {
  std::vector<ContactPoint> left;
  for (ContactPoint p : body.contact.points) {
    if (presses(pressed, p.owner) || body.still_s[p.owner] > kStill_s) continue;
    p.presses = false;
    left.push_back(p);
  }
  return left;
}

bool nothing_new(const TemporaryContact& contact, std::span<const ContactPoint> left) {
  return std::ranges::equal(contact.points, left, [](const ContactPoint& a, const ContactPoint& b) {
    return a.owner == b.owner && !a.presses && !b.presses;
  });
}

Change indentation(const MeshDraft& draft, TemporaryContact after) {
  Change change{.cause = Cause::indented, .delta = draft.delta(), .seeds = draft.seeds(), .contact = std::move(after)};
  change.delta.temporary = true;
  return change;
}

}  // namespace

MeshDraft original_surface(const Body& body) {
  const MeshDraft now(body.mesh, body.particle_view());
  if (!body.contact.inverse) return now;
  std::optional<MeshDraft> original = without(now, body.contact);
  SECTIO_ASSERT(original.has_value(), "nothing changes a mesh under temporary elements");
  return original.value_or(now);
}

TriangleId original_triangle(const Body& body, TriangleId t) {
  if (!body.contact.inverse) return t;
  const MeshDraft original = original_surface(body);
  if (original.triangle(t).alive()) return t;
  // Temporary particles are few, so an original vertex is close by.
  const MeshDraft now(body.mesh, body.particle_view());
  std::vector<VertexId> ring(body.mesh.triangle(t).v.begin(), body.mesh.triangle(t).v.end());
  for (std::size_t i = 0; i < ring.size(); ++i) {
    if (const TriangleId beside = original.incident(ring[i]); beside != kNone) return beside;
    for (const TriangleId around : now.fan(ring[i])) {
      const auto& v = body.mesh.triangle(around).v;
      ring.insert(ring.end(), v.begin(), v.end());
    }
  }
  return kNone;
}

void watch_particles_let_go(Body& body, std::span<const ContactPoint> points, double step_s) {
  const TemporaryContact& contact = body.contact;
  if (contact.points.empty()) return;
  const MeshDraft now(body.mesh, body.particle_view());
  const MeshDraft original = original_surface(body);
  for (std::size_t i = 0; i < contact.points.size(); ++i) {
    const ContactPoint& p = contact.points[i];
    if (presses(points, p.owner)) continue;
    if (p.owner >= body.still_s.size()) body.still_s.resize(p.owner + 1, 0);
    if (p.presses || moves(now, original, contact, i)) body.still_s[p.owner] = 0;
  }
  for (double& still_s : body.still_s) still_s += step_s;
}

std::optional<Change> plan_indentation(const Body& body, std::span<const ContactPoint> points,
                                       std::vector<HeldParticle>& held) {
  held.clear();
  std::vector<ContactPoint> all(points.begin(), points.end());
  const std::vector<ContactPoint> left = not_back_yet(body, points);
  if (points.empty() && nothing_new(body.contact, left)) return std::nullopt;
  all.insert(all.end(), left.begin(), left.end());
  MeshDraft draft(body.mesh, body.particle_view());
  TemporaryContact contact = body.contact;
  Press pressed = press(draft, contact, all, {});
  if (pressed.change == ContactChange::refused) return plan_release(body);
  held = std::move(pressed.held);
  return indentation(draft, std::move(contact));
}

std::optional<Change> plan_release(const Body& body) {
  if (!body.contact.inverse) return std::nullopt;
  MeshDraft draft(body.mesh, body.particle_view());
  TemporaryContact contact = body.contact;
  const bool released = release(draft, contact);
  SECTIO_ASSERT(released, "nothing changes a mesh under temporary elements");
  if (!released) return std::nullopt;
  return indentation(draft, std::move(contact));
}

}  // namespace sectio
