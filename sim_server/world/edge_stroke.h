// The way of an edge through the tissue of a body, from where it broke in to where its cut ends: in each step the poses
// at which it cuts, for the cutting engine, and the force that holds it. An edge cuts where its tip goes (paper B,
// figure 4), or everywhere along its length (paper A, 2.3; whole_edge.h), as the engine says (CutTraits).
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "sim_server/world/blade_sides.h"
#include "sim_server/world/body.h"
#include "sim_server/world/cut_resistance.h"
#include "sim_server/world/instrument_edge.h"

namespace sectio {

// A step of an edge in tissue.
struct StrokeStep {
  const InstrumentEdge& edge;        // at the end of the step
  std::span<const JointPose> poses;  // since the last step; none: the instrument rests
  double opening_before_rad;
  const CutPoint& cut;
  Pose frame_world;                  // the tissue at rest around the edge
  Vec3 point_world_m, normal_world;  // point and normal of the surface where the edge enters it
  double step_s;
};

class EdgeStroke {
 public:
  static constexpr std::string_view kLifted = "it was lifted out", kLeft = "its edge has left the tissue",
                                    kAside = "it went aside, and the tissue slipped off",
                                    kSunk = "all of its edge is beneath the surface, where its blunt part pushes";

  // The edge breaks in here, after it came so far sideways; 0: with its tip first.
  BladeMotion begin(Body& body, const InstrumentEdge& edge, const Vec3& point_world_m, double sideways_m);

  struct Outcome {
    BladeMotion motion;
    // A blade that doesn't cut takes tissue along: the end of its cut, or walls.
    std::vector<PointConstraint> held = {};
    bool is_sunk = false;                   // the blunt part above its edge pushes the surface, and doesn't cut
    bool slips = false;                     // the tissue slips off the blade, and the cut ends
    std::string_view why_lifted = kLifted;  // if the cut ends; for a person
  };
  Outcome follow(Body& body, const StrokeStep& step);

  // The walls that it presses, after a change of the topology.
  std::vector<PointConstraint> press_again(Body& body, const InstrumentEdge& edge) {
    return goes_aside_ ? sides_.press(body, edge, Vec3::Zero()) : std::vector<PointConstraint>{};
  }
  CutResistance& resistance() { return resistance_; }
  const CutResistance& resistance() const { return resistance_; }

  template <class A>
  void archive(A& a) {
    a(tip_before_world_m_, cut_at_world_m_, drags_end_, goes_aside_, sides_, resistance_);
  }

 private:
  Outcome follow_tip(Body& body, const StrokeStep& step);
  bool tissue_slips_off(const Body& body, const StrokeStep& step, const Blade& blade,
                        const Vec3& at_surface_world_m) const;
  Outcome follow_whole_edge(Body& body, const StrokeStep& step);

  Vec3 tip_before_world_m_ = Vec3::Zero();  // the pose before; for a cutting tip the last one at which it cut
  Vec3 cut_at_world_m_ = Vec3::Zero();      // the tip where the whole edge has cut last
  bool drags_end_ = false;                  // it has taken the end of its cut along since then
  bool goes_aside_ = false;                 // it has cut nothing since it began to go aside, or back
  BladeSides sides_;
  CutResistance resistance_;
};

}  // namespace sectio
