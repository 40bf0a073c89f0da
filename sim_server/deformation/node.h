// A node: what a deformation model moves, and what contacts push. One node or a few carry a vertex of the surface,
//
//   v = sum_a weight_a v_a,   and an impulse p on the vertex changes each of them by  dv_a = weight_a p / m_a.
//
// In most models a particle is its own node; in a lattice (hexa/) the corners of a cell carry what is embedded in it.
#pragma once

#include <cstdint>
#include <span>

#include "common/math/types.h"

namespace sectio {

struct NodeShare {
  std::uint32_t node;
  double weight;
};
struct NodeMotion {
  Vec3 velocity_m_per_s;
  double inverse_mass_per_kg;  // 0: held
};
// The change of a node by contacts, in a step.
struct NodeChange {
  std::uint32_t node;
  Vec3 faster_by_m_per_s, moved_by_m;
};

inline void apply(std::span<const NodeChange> changes, std::span<Vec4f> position_world_m,
                  std::span<Vec4f> velocity_m_per_s) {
  for (const NodeChange& c : changes) {
    velocity_m_per_s[c.node].head<3>() += c.faster_by_m_per_s.cast<float>();
    position_world_m[c.node].head<3>() += c.moved_by_m.cast<float>();
  }
}

}  // namespace sectio
