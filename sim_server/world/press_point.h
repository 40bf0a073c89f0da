// The point of an instrument that presses a body, and the point of the surface under it. It slides over the surface
// with the instrument.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim_server/world/body.h"
#include "sim_server/world/instrument_edge.h"
#include "sim_server/world/step_io.h"

namespace sectio {

class PressPoint {
 public:
  // The point of the instrument: between two of its corners, or at one.
  struct OnTool {
    std::array<std::size_t, 2> corners{};
    double along = 0;     // from the first corner to the second, 0 to 1
    bool at_tip = false;  // only the tip breaks the surface

    template <class A>
    void archive(A& a) {
      a(corners, along, at_tip);
    }
  };

  // It presses where the instrument has met the surface.
  void begin(const Body& body, const OnTool& on_tool, const SurfaceHit& hit);
  // The tip A presses there.
  void stand_at_tip(TriangleId triangle, const Vec3& bary);

  const OnTool& on_tool() const { return on_tool_; }
  TriangleId triangle() const { return triangle_; }
  const Vec3& bary() const { return bary_; }
  Vec3 tool_point_world_m(const InstrumentEdge& edge) const;
  // The depth of the instrument's point beneath the nearest triangle.
  double depth_m(Body& body, const InstrumentEdge& edge);

  // The constraint that holds the surface out of the instrument. Nothing: it has jumped through.
  std::optional<PointConstraint> press(Body& body, const InstrumentEdge& edge);
  // The places that the instrument touches, for temporary elements (paper A, 2.2), the one that presses first. Nothing
  // when there is no surface near by.
  std::vector<ContactPoint> press_with_templates(Body& body, const InstrumentEdge& edge);
  // `normal_world`: of the surface under the point.
  ContactGap gap(Body& body, const InstrumentEdge& edge, const Vec3& normal_world) const;

  std::uint64_t searches() const { return searches_; }  // in the whole tree, so far

  template <class A>
  void archive(A& a) {
    a(on_tool_, triangle_, bary_, searches_);
  }

 private:
  void slide_to(Body& body, const Vec3& tool_point_world_m);
  Vec3 point_world_m(Body& body) const;
  std::vector<std::size_t> corners_beside(const InstrumentKind& kind) const;

  OnTool on_tool_;
  TriangleId triangle_ = kNone;  // the surface without temporary elements has it
  Vec3 bary_ = Vec3::Zero();
  std::uint64_t searches_ = 0;
};

}  // namespace sectio
