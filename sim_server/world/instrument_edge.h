// One edge of an instrument at one pose: its kind, its shape there, and where its parts are in the world. A value; it
// knows nothing of bodies.
#pragma once

#include <cstdint>
#include <optional>

#include "sim_server/collision/contact.h"
#include "sim_server/instruments/instrument.h"
#include "sim_server/scene/scene.h"
#include "sim_server/surface/cutting/blade_place.h"

namespace sectio {

class InstrumentEdge {
 public:
  // `id`: the index by which cutting knows the edge; `number`: its number among the edges of the instrument.
  InstrumentEdge(std::uint32_t id, const ToolSpec& tool, std::size_t number);

  // The same edge elsewhere.
  InstrumentEdge at(const JointPose& pose) const;
  // The same edge, here and elsewhere, which closes from there about tissue that ends between its blades.
  InstrumentEdge closing_from(double opening_rad) const;
  double closes_from_rad() const { return state_.closes_from_rad; }

  std::uint32_t id() const { return id_; }
  const InstrumentKind& kind() const { return *kind_; }
  double ball_radius_m() const { return geometry_.sphere_radius_m; }  // about the tip A; 0: there is none
  double largest_force_n() const { return largest_force_n_; }         // largest force of the hand
  const JointPose& pose() const { return pose_; }
  const InstrumentShape& shape() const { return shape_; }

  bool is_blunt() const;  // there is nothing that cuts
  double length_m() const { return (shape_.edge_heel_tool_m - shape_.edge_tip_tool_m).norm(); }
  Vec3 tip_world_m() const { return pose_.to_world(shape_.edge_tip_tool_m); }
  Vec3 heel_world_m() const { return pose_.to_world(shape_.edge_heel_tool_m); }
  // The vector from the tip to the heel.
  Vec3 along_world_m() const { return pose_.orientation * (shape_.edge_heel_tool_m - shape_.edge_tip_tool_m); }
  // The unit direction in which the edge cuts; nothing: any direction.
  std::optional<Vec3> sharp_side_world() const;
  ToolCorners corners() const;
  Blade blade() const;

  template <class A>
  void archive(A& a) {
    a(state_, pose_, shape_);
  }

 private:
  std::uint32_t id_;
  const InstrumentKind* kind_;
  ToolGeometry geometry_;
  InstrumentState state_;
  double largest_force_n_;
  JointPose pose_;
  InstrumentShape shape_;
};

}  // namespace sectio
