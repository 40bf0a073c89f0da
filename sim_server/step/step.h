// The stages of a step, in the order in which Simulation::step() lists them. Each loops over the bodies, in order of
// their ids; what passes between stages is the context, which is made anew in each step.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim_server/world/step_io.h"
#include "sim_server/world/world.h"

namespace sectio {

// A body, as the stages of one step see it.
struct BodyStep {
  bool at_work = false;    // an instrument cuts it or looks for where to, or a part may have come off
  bool changed = false;    // its topology changed
  bool disturbed = false;  // it was touched, held or cut: what rests on it wakes
  std::vector<Entry> entries;
  std::vector<BladeMotion> motions;
  struct Wall {
    PointConstraint constraint;
    std::optional<std::size_t> meeting;  // nothing: against a point that is held
  };
  std::vector<Wall> walls;  // other bodies that it touches
  double work_j = 0;        // work on it by instruments and by other bodies
  double processor_s = 0;   // processor's time of its stages, if somebody measures
};

// Two bodies that deform and touch each other.
struct Meeting {
  std::array<std::uint32_t, 2> bodies;
  Vec3 on_both_n = Vec3::Zero();  // the forces on both, which would be opposite if both had moved at once
};

struct StepContext {
  StepContext(const StepInput& in, StepOutput& out, std::size_t body_count, double (*clock)())
      : input(in), output(out), bodies(body_count), processor_s(clock) {}

  void emit(EventKind kind, std::uint32_t body_id, std::uint32_t tool_id, std::string text = {}) {
    output.events.push_back({output.step, kind, body_id, tool_id, std::move(text)});
  }

  const StepInput& input;
  StepOutput& output;
  bool gravity_turned = false;
  std::vector<BodyStep> bodies;  // grows with the parts that come off
  std::vector<Meeting> meetings;
  double (*processor_s)();  // the processor's time so far; nullptr: nobody measures
};

// Calls stage(body_id) for each body that there is at the beginning, and measures what it takes.
template <class Stage>
void for_each_body(SimulatedWorld& world, StepContext& context, const Stage& stage) {
  for (std::uint32_t b = 0, count = static_cast<std::uint32_t>(world.bodies.size()); b < count; ++b) {
    const double begun_s = context.processor_s ? context.processor_s() : 0;
    stage(b);
    if (context.processor_s) context.bodies[b].processor_s += context.processor_s() - begun_s;
  }
}

// No instrument touches the body, and nothing has changed it in this step.
bool is_idle(SimulatedWorld& world, const StepContext& context, std::uint32_t body_id);

// Gives each edge of an instrument, each pair of jaws and each engine between bodies one reaction a constraint.
// Constraints are in the order of their sources. An edge without a constraint gets no reaction.
void distribute_reactions(SimulatedWorld& world, StepContext& context, std::uint32_t body_id,
                          std::span<const PointConstraint> constraints, std::span<const Reaction> reactions);

// Forgets reactions that are not finite.
void make_finite(std::span<Reaction> reactions);

void take_samples(SimulatedWorld& world, StepContext& context);  // instruments are where their newest samples are
void grasp(SimulatedWorld& world, StepContext& context);         // jaws close, open, or lose what they held
void tilt(SimulatedWorld& world, StepContext& context);          // gravity turns
void touch(SimulatedWorld& world, StepContext& context);         // edges meet surfaces, and say what they want to cut
void cut(SimulatedWorld& world, StepContext& context);           // engines plan cuts; accepted ones change the topology
void tidy(SimulatedWorld& world, StepContext& context);          // slivers are mended, away from instruments
void split(SimulatedWorld& world, StepContext& context);         // parts that came off become bodies
void indent(SimulatedWorld& world, StepContext& context);        // temporary elements follow instruments that press
void spare(SimulatedWorld& world, StepContext& context);         // a late session leaves idle bodies as they are
void meet(SimulatedWorld& world, StepContext& context);          // bodies that deform press against each other
void deform(SimulatedWorld& world, StepContext& context);        // bodies move
void watch(SimulatedWorld& world, StepContext& context);         // bodies fall asleep, freeze, and check their models
void interact(SimulatedWorld& world, StepContext& context);      // fluids and threads go on between bodies
void collide(SimulatedWorld& world, StepContext& context);  // bodies that move as a whole meet others and the floor
void guard(SimulatedWorld& world, StepContext& context);    // nothing leaves that is not finite, or out of bounds
void feel(SimulatedWorld& world, StepContext& context);     // contact models for the hands
void report(SimulatedWorld& world, StepContext& context);   // the numbers of the step

}  // namespace sectio
