// Contacts as plain values: all that the finders and the solver of contacts share.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/math/types.h"

namespace sectio {

constexpr std::uint32_t kImmovable = 0xffffffffu;

// A particle of a deforming body that is touched.
struct SoftParticle {
  Vec3 velocity_m_per_s = Vec3::Zero();
  double inverse_mass_per_kg = 0;
  Vec3 shift_m = Vec3::Zero();  // out of the body that it was in
};

// Each side is a rigid body, particles, or immovable.
struct RigidContact {
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal_world = Vec3::UnitZ();  // unit; pushes `body`, and particles with a positive share
  double depth_m = 0;                 // negative: a gap that may close within the step
  std::uint32_t body = kImmovable;
  std::uint32_t other = kImmovable;
  // The weights of particles for the point on a deforming surface: positive on the side of `body`, negative on the
  // other side. 0: not used.
  std::array<std::uint32_t, 4> particles{};
  std::array<double, 4> shares{};
  Vec3 surface_velocity_m_per_s = Vec3::Zero();  // of an immovable other side, e.g. an instrument
  double largest_speed_m_per_s = 0.05;           // at which depth is undone
  double friction = 0.4;
  // More than 0 makes a grip of the contact: it holds the point to the surface in all directions, by this force at
  // most.
  double grip_n = 0;
};

// Contacts of points that lie below the plane z = floor, or above it by at most `reach_m`; keeps the few that bear the
// body, see keep_bearing(). `points`: in the world.
void floor_contacts(std::span<const Vec3f> points_world_m, std::span<const std::uint8_t> counts, double floor_z_m,
                    double reach_m, std::uint32_t body, std::vector<RigidContact>& contacts);

// Reduces the contacts [from, end) of one pair to the deepest one, and to those that meet the other body first when the
// body tilts a little, by three angles in eight directions across the mean normal. The body can't reach the other
// points before these: on an uneven face it rocks on the points that bear it, and comes to rest.
void keep_bearing(std::vector<RigidContact>& contacts, std::size_t from);

}  // namespace sectio
