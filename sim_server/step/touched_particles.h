// Particles of deforming bodies that take part in the contacts of one step: copied from their bodies, and written back
// with the changes that contacts made.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sim_server/body_contact/rigid_contact.h"
#include "sim_server/world/body.h"

namespace sectio {

class TouchedParticles {
 public:
  explicit TouchedParticles(std::span<const std::unique_ptr<Body>> bodies) : bodies_(bodies) {}

  // Its number in `all()`, which may grow.
  std::uint32_t number_of(std::uint32_t body_id, VertexId v);
  std::span<SoftParticle> all() { return particles_; }

  // Adds a point of a triangle, or a vertex, to a contact on a side: +1 the side of `body`, -1 the other side.
  // Its depth becomes the one before the bodies deformed in this step, whose motion contacts may still change.
  void join(RigidContact& contact, std::uint32_t body_id, const std::array<VertexId, 3>& v, const Vec3& bary,
            double side, double step_s);
  void join(RigidContact& contact, std::uint32_t body_id, VertexId v, double side, double step_s) {
    join(contact, body_id, {v, kNone, kNone}, Vec3::UnitX(), side, step_s);
  }
  // Distributes a contact's impulse on `other` over the particles of the other side.
  void loads_of(const RigidContact& contact, const Vec3& impulse_on_other_n_s, std::vector<RestingLoad>& loads) const;

  // Positions follow velocities as those of the step before did.
  void give_back(double step_s);

 private:
  std::span<const std::unique_ptr<Body>> bodies_;
  std::map<std::pair<std::uint32_t, VertexId>, std::uint32_t> numbers_;
  std::vector<std::pair<std::uint32_t, VertexId>> owners_;
  std::vector<SoftParticle> particles_;
};

}  // namespace sectio
