// The force with which the tissue of a body resists an edge that is in it: the front of its cut holds the edge
// (blade_front.h), or the surface that the edge has gone beneath pushes it out.
#pragma once

#include <optional>

#include "sim_server/haptics/contact_model_fitter.h"
#include "sim_server/world/blade_front.h"
#include "sim_server/world/body.h"
#include "sim_server/world/instrument_edge.h"

namespace sectio {

class CutResistance {
 public:
  // Nothing resists any more.
  void release();
  // A step begins: no force until the edge is met.
  void begin_step(double step_s);
  // The edge is here now, whether or not the mesh follows it. `frame_world`: of the body at rest around it, told by the
  // vertex `near`; where another vertex tells it, the edge has not moved by as much as the two differ. Loose: open
  // blades hold no tissue.
  void meet(Body& body, const InstrumentEdge& edge, const Pose& frame_world, VertexId near, bool loose);
  // Instead of the front, the surface at a point pushes the side AC out, along its normal.
  void push_out(const Body& body, const InstrumentEdge& edge, const Vec3& point_world_m, const Vec3& normal_world);

  const Vec3& force_on_tool_n() const { return force_n_; }
  double work_j() const { return work_j_; }  // work by the hand against fronts so far
  FeltFront front(const InstrumentKind& kind, double step_s) const;

  template <class A>
  void archive(A& a) {
    a(front_, frame_world_, frame_before_world_, near_, edge_world_m_, edge_middle_rest_m_, force_n_, work_j_);
  }

 private:
  BladeFront front_;
  std::optional<Pose> frame_world_, frame_before_world_;  // the edge was met here in this step, and in the last one
  VertexId near_ = kNone;                                 // told the frame of the last meeting
  EdgeAtRest edge_world_m_;                               // then, in the world
  Vec3 edge_middle_rest_m_ = Vec3::Zero();
  Vec3 force_n_ = Vec3::Zero();
  double work_j_ = 0;
};

}  // namespace sectio
