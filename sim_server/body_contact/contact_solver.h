// Solves the contacts of bodies by impulses on velocities, one contact after the other, forwards and backwards (Catto
// 2005), without restitution and with Coulomb's friction. Rigid bodies and particles of deforming bodies take part
// alike: one side gains the momentum that the other loses, and no contact adds kinetic energy. Deterministic; allocates
// scratch only.
#pragma once

#include <span>

#include "sim_server/body_contact/rigid_body.h"
#include "sim_server/body_contact/rigid_contact.h"

namespace sectio {

struct ContactSettings {
  double step_s = 0.001;
  int sweeps = 30;
};

// The bodies and particles that contacts refer to by number.
struct ContactSides {
  std::span<RigidBody* const> bodies;
  std::span<SoftParticle> particles = {};
};

// Writes velocities. `impulses_on_other_n_s`: empty, or one a contact, which gets the impulse on `other`.
void solve_contacts(const ContactSides& sides, std::span<const RigidContact> contacts, const ContactSettings& settings,
                    std::span<Vec3> impulses_on_other_n_s = {});

// Pushes overlapping bodies apart, a part of the depth at a time, without changing any velocity: depth is an error of
// position, and an impulse that undid it would let bodies jump. Moves rigid bodies; for particles, adds to shift_m.
void undo_depths(const ContactSides& sides, std::span<const RigidContact> contacts, const ContactSettings& settings);

}  // namespace sectio
