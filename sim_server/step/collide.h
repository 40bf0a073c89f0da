// Contacts of all bodies that move as a whole: these meet instruments, floor and bodies, move, and come to rest. Bodies
// that deform meet each other in meet.cpp.
//
// All bodies have taken their own step before. Contact then changes the velocities of their particles and of the pieces
// alike, and moves particles by the change of their velocities. A sleeping piece bears others as if it could not move,
// and costs only the impulses that it goes on giving to the body that it lies on, unless that body sleeps, too. It
// wakes when something bumps into it, and when a body next to it is touched by an instrument or changed by a cut.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sim_server/world/body.h"

namespace sectio {

// `disturbed`: by body, whether an instrument touched or held it or a cut changed it in this step; empty: none.
void collide_bodies(std::span<const std::unique_ptr<Body>> bodies, std::span<const std::uint8_t> disturbed,
                    const Scene& scene);

}  // namespace sectio
