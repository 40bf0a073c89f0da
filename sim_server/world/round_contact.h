// A blunt instrument with a radius presses with a ball about its tip and with its shaft, as capsules that hold samples
// of the surface out of themselves (surface_samples.h).
// The layer of tissue in series (contact_layer.h) is no deeper than half the radius: instruments do not sink through.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sim_server/world/body.h"
#include "sim_server/world/instrument_edge.h"
#include "sim_server/world/surface_samples.h"

namespace sectio {

class RoundContact {
 public:
  // Whether the instrument touches this body so.
  static bool is_for(const Body& body, const InstrumentEdge& edge);

  // Takes the samples that the instrument has reached on its way from another pose. Returns the deepest one; nothing
  // when none is as deep as `least_depth_m`.
  std::optional<SurfaceSample> press(Body& body, const InstrumentEdge& edge, const Pose& before, double least_depth_m);
  // One constraint a sample.
  std::vector<PointConstraint> constraints(const Body& body, const InstrumentEdge& edge) const;

  // The middle of what the instrument presses, by force, and the sample that is nearest to it.
  struct Middle {
    Vec3 point_world_m;
    SurfaceSample nearest;
  };
  // Called after the step, with its constraints and their reactions. Nothing when nothing pushes.
  std::optional<Middle> deformed(const Body& body, std::span<const PointConstraint> constraints,
                                 std::span<const Reaction> reactions);
  // The depth of the deepest sample.
  double depth_m() const;

  template <class A>
  void archive(A& a) {
    a(samples_);
  }

 private:
  std::vector<SurfaceSample> samples_;
};

}  // namespace sectio
