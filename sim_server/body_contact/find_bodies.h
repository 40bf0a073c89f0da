// Contacts of two bodies: vertices of one body in the surface of the other, or close above it.
#pragma once

#include <cstdint>
#include <vector>

#include "sim_server/body_contact/body_contact.h"
#include "sim_server/collision/collision_engine.h"

namespace sectio {

// At most so many vertices near the other body's surface are probed; evenly chosen by number when there are more.
// A body that moves as a whole rests on a few; one that deforms sinks in between them.
constexpr std::size_t kMaxProbedVertices = 64, kMaxProbedSoft = 1024;
constexpr double kTouchReach_m = 2e-4;       // a gap that counts as contact; faster bodies see further
constexpr double kWaking_m_per_s = 0.02;     // a body so fast wakes a sleeping one that it bumps into
constexpr double kDeepestContact_m = 0.005;  // deeper contacts have no reliable nearest surface

// A surface with its tree, which must be up to date; `view.body` is the number of the body in its contacts.
struct SearchedSurface {
  SurfaceView view;
  const CollisionEngine& tree;
};

// A vector along the normal of the surface at a vertex, as long as twice the area of the triangles around it.
Vec3 area_at(const SurfaceView& surface, VertexId v);

// Appends contacts of vertices that are at most reach_m above the opposite surface: first of vertices of `one`, then of
// vertices of `other`, each in order of vertex. `one` becomes side `one` of all of them.
// O(vertices + probed x log triangles).
void find_body_contacts(const SearchedSurface& one, const SearchedSurface& other, double reach_m,
                        std::vector<BodyContact>& contacts, std::size_t most_probed = kMaxProbedVertices);

}  // namespace sectio
