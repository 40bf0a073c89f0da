// A world engine simulates a process between bodies: a fluid that runs from one to another, a thread that holds two
// together. It sees the bodies that the scene names, and the parts that come off them.
//
//   before the bodies deform    constrain(): the points that it holds or pulls, then felt(): the reactions
//   after they have deformed    step(): all other effects, on all of its bodies at once
//   whenever a body changes     follow(), part_left()
#pragma once

#include <span>
#include <vector>

#include "sim_server/deformation/point_constraint.h"
#include "sim_server/engine/engine.h"

namespace sectio {

class WorldEngine {
 public:
  virtual ~WorldEngine() = default;

  // Appends the constraints on the points of a body in this step.
  virtual void constrain(const SharedBody&, double /*step_s*/, std::vector<PointConstraint>&) {}
  // The reactions of these constraints, in their order; none when the body was not stepped.
  virtual void felt(const SharedBody&, std::span<const Reaction>) {}
  // Once a step, after all bodies have deformed and before they collide. It may change the state of their particles.
  virtual void step(std::span<const SharedBody> bodies, double step_s) = 0;
  // Does step() move particles? Then its bodies never sleep.
  virtual bool moves_particles() const { return true; }

  // The topology of one of its bodies has changed; see Engine::follow().
  virtual void follow(const SharedBody& body, const TopologyChange& change) = 0;
  // A part came off one of its bodies and is one of its bodies, too; vertex_from: by vertex of the part its slot in the
  // parent. The change by which the parent gives it up comes after this.
  virtual void part_left(const SharedBody& parent, const SharedBody& part, std::span<const VertexId> vertex_from) = 0;
  // See Engine::publish().
  virtual void publish(const SharedBody&, std::vector<ScalarField>&) const {}
  // See Engine::archive(). Its bodies have been read before.
  virtual void archive(Archive& a) { a.refuse(); }
};

}  // namespace sectio
