// A deforming body that is in trouble is mended. A flaw is a number that isn't finite, a vertex out of the world or too
// fast, a body that has collapsed or swollen. The ladder, while flaws follow each other:
//
//   restored   the last good state comes back, at rest, and the stable driver takes the next steps
//   reshaped   the shape at rest comes back, where the body is
//   frozen     the body stays in its last good state. When nothing has touched it for a while it is set free again,
//              after each freeze twice as long a while
//
// A body that has fallen or slid out of the world as a whole is in no trouble: it has left, and stays at the edge for
// good.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim_server/deformation/deformation_engine.h"

namespace sectio {

constexpr double kWorldReach_m = 10;                   // no vertex is further from the origin along an axis
constexpr double kMostSpeed_m_per_s = 50;              // speed of any vertex
constexpr double kLeastVolume = 0.1, kMostVolume = 5;  // volume of a body over its volume at rest

// The first entry that isn't finite or is beyond the bounds, in positions and velocities; kNone: none.
VertexId first_beyond_bounds(const ParticleState& particles);

class Recovery {
 public:
  enum class Remedy : std::uint8_t { restored, reshaped, frozen, left };

  void count_step() { ++steps_; }  // call once a step
  // Call before the body deforms: keeps its state now and then, and after every change of topology. Call it only with
  // a state that has no flaw.
  void keep(const SharedBody& body, const DeformationEngine& deformation);
  // Call after all that moves the body. For a person; nothing while all is well.
  std::optional<std::string> flaw(const SharedBody& body, const DeformationEngine& deformation);
  // Mends the body, which has a flaw, by the next rung of the ladder.
  Remedy mend(const SharedBody& body, DeformationEngine& deformation, double step_s);

  // Call in each step of a frozen body. True: it is free again, and the stable driver goes on. A body that has left
  // never is.
  bool thaws(bool touched, double step_s, DeformationEngine& deformation);

  template <class A>
  void archive(A& a) {
    a(good_, revision_, steps_, mended_at_, mended_, frozen_, untouched_s_, left_);
  }

 private:
  Remedy next_remedy(double step_s);
  void restore(const SharedBody& body, DeformationEngine& deformation, bool at_rest);

  struct State {
    std::vector<Vec4f> position_world_m;
    DeformationState engine;

    template <class A>
    void archive(A& a) {
      a(position_world_m, engine);
    }
  };
  State good_;
  std::uint64_t revision_ = 0, steps_ = 0;
  std::uint64_t mended_at_ = 0;
  int mended_ = 0, frozen_ = 0;
  double untouched_s_ = 0;
  bool left_ = false;
};

}  // namespace sectio
