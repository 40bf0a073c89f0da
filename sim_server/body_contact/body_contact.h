// A contact as a plain value. The finders (find_floor.h, find_bodies.h, find_lips.h) make contacts, and ContactSolver
// solves them.
#pragma once

#include <array>
#include <cstdint>

#include "common/math/types.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

constexpr std::uint32_t kImmovable = 0xffffffffu;

// One side of a contact: the point of a body that it pushes.
struct ContactSide {
  std::uint32_t body = kImmovable;  // a number in the list of bodies that the solver gets
  // The point of a body that deforms: the weighted mean of these vertices. A rigid body needs none.
  std::array<VertexId, 3> v{kNone, kNone, kNone};
  Vec3 weights = Vec3::Zero();
};
inline ContactSide side_at(std::uint32_t body, VertexId v) {
  return {body, {v, kNone, kNone}, Vec3::UnitX()};
}

struct BodyContact {
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal_world = Vec3::UnitZ();  // unit; pushes `one`
  double depth_m = 0;                 // negative: a gap that may close within the step
  double area_m2 = 0;                 // the surface that it stands for
  ContactSide one, other;
  Vec3 surface_velocity_m_per_s = Vec3::Zero();  // velocity of an immovable other side, e.g. an instrument
  double largest_speed_m_per_s = 0.05;           // largest speed at which depth is undone
  double friction = 0.4;                         // Coulomb's coefficient
  // More than 0 makes a grip of the contact: it holds the point to the surface in all directions, by this force at
  // most. An impulse J leaves the velocity softness * J apart: a spring k with a damper c in series has the softness
  // 1 / (h (c + h k)).
  double grip_n = 0;
  double grip_softness_per_kg = 0;
};

}  // namespace sectio
