// Contacts of bodies, solved as impulses on velocities, one after the other and there and back (Catto 2005): no
// restitution, Coulomb's friction. Rigid bodies and particles of bodies that deform take part alike, so what one side
// gains in momentum the other loses, and no contact adds kinetic energy. Deterministic; no allocation but scratch.
#pragma once

#include <span>

#include "sim_server/body_contact/rigid_body.h"
#include "sim_server/body_contact/rigid_contact.h"

namespace sectio {

struct ContactSettings {
  double step_s = 0.001;
  int sweeps = 30;
};

// What contacts refer to by number.
struct ContactSides {
  std::span<RigidBody* const> bodies;
  std::span<SoftParticle> particles = {};
};

// Writes velocities. `impulses_on_other_n_s`: empty, or one a contact: what it gave to `other`.
void solve_contacts(const ContactSides& sides, std::span<const RigidContact> contacts, const ContactSettings& settings,
                    std::span<Vec3> impulses_on_other_n_s = {});

// Pushes apart what overlaps, a bit at a time, without changing any velocity: depth is an error of position, and to
// undo it by an impulse would let bodies jump. Shifts bodies; of particles, adds to shift_m.
void undo_depths(const ContactSides& sides, std::span<const RigidContact> contacts, const ContactSettings& settings);

}  // namespace sectio
