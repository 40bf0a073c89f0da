#include "sim_server/step/touched_particles.h"

#include "common/core/error.h"

namespace sectio {

std::uint32_t TouchedParticles::number_of(std::uint32_t body_id, VertexId v) {
  const auto [it, is_new] = numbers_.try_emplace({body_id, v}, static_cast<std::uint32_t>(particles_.size()));
  if (is_new) {
    const Body& body = *bodies_[body_id];
    owners_.push_back(it->first);
    particles_.push_back({body.particle_view().velocity(v),
                          body.frozen ? 0 : body.engines.deformation->inverse_mass_per_kg(v), Vec3::Zero()});
  }
  return it->second;
}

void TouchedParticles::join(RigidContact& contact, std::uint32_t body_id, const std::array<VertexId, 3>& v,
                            const Vec3& bary, double side, double step_s) {
  std::size_t free = 0;
  while (free < contact.shares.size() && contact.shares[free] != 0) ++free;
  for (std::size_t a = 0; a < v.size(); ++a) {
    const double share = side * bary[static_cast<int>(a)];
    if (v[a] == kNone || share == 0) continue;
    SECTIO_ASSERT(free < contact.shares.size(), "a vertex and a triangle have four particles");
    contact.particles[free] = number_of(body_id, v[a]);
    contact.shares[free] = share;
    contact.depth_m += step_s * share * particles_[contact.particles[free]].velocity_m_per_s.dot(contact.normal_world);
    ++free;
  }
}

void TouchedParticles::loads_of(const RigidContact& contact, const Vec3& impulse_on_other_n_s,
                                std::vector<RestingLoad>& loads) const {
  for (std::size_t a = 0; a < contact.shares.size(); ++a) {
    if (contact.shares[a] == 0) continue;
    const auto& [body_id, v] = owners_[contact.particles[a]];
    loads.push_back({body_id, v, -contact.shares[a] * impulse_on_other_n_s});
  }
}

void TouchedParticles::give_back(double step_s) {
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    const auto& [body_id, v] = owners_[i];
    const SoftParticle& p = particles_[i];
    Body& body = *bodies_[body_id];
    const Vec3 gained = p.velocity_m_per_s - body.particle_view().velocity(v);
    if (!gained.isZero(0) || !p.shift_m.isZero(0)) body.nudge(v, gained, step_s * gained + p.shift_m);
  }
}

}  // namespace sectio
