// The pieces of a surface (components), and the frame in the world of the shape at rest of each. Something holds an
// anchored piece: its frame is that of the body. The frame of a free one follows its vertices by shape matching, and a
// free piece may have a bed to lie on.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/math/types.h"
#include "common/mesh/triangle_mesh.h"
#include "sim_server/deformation/shape_matching.h"

namespace sectio {

class RestFrames {
 public:
  // Begins with component 0, which is anchored and has no vertices.
  explicit RestFrames(const Pose& body_world);

  void resize(std::uint32_t vertex_slots);
  // `component` kNone: the vertex is in no component.
  void move(VertexId v, std::uint32_t component);
  // Makes a component of these vertices, or makes one anew; one that stays free keeps its frame.
  void set(std::uint32_t component, std::span<const VertexId> vertices, bool free);
  void set_bed(std::uint32_t component, const Vec3& point_world_m, const Vec3& normal_world);

  std::uint32_t size() const { return static_cast<std::uint32_t>(components_.size()); }
  std::uint32_t component_of(VertexId v) const { return component_of_[v]; }
  bool is_free(std::uint32_t component) const { return components_[component].free; }
  bool any_free() const { return std::ranges::any_of(components_, &Component::free); }
  const Pose& frame_world(std::uint32_t component) const { return components_[component].frame_world; }

  // The frames of free components follow their vertices, which are weighted by their masses; `moved(v)` is called for
  // each of these.
  template <class Moved>
  void follow(std::span<const Vec3> rest_body_m, std::span<const double> mass_kg,
              std::span<const Vec4f> position_world_m, const Moved& moved) {
    for (Component& c : components_) {
      if (!c.free || c.vertices.empty()) continue;
      match(c, rest_body_m, mass_kg, position_world_m);
      for (const VertexId v : c.vertices) moved(v);
    }
  }
  // Vertices that have come below the bed of their component in a step of step_s are put onto it and stop, and go back
  // the way that they slid by up to the coefficient of friction times their depth.
  void stop_at_beds(double step_s, std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) const;

  std::vector<Pose> save() const;
  // A component that has come since keeps its frame; one without a finite frame gets the frame of the body.
  void restore(std::span<const Pose> frames_world);

  template <class A>
  void archive(A& a) {
    a(body_world_, components_, component_of_, place_in_component_);
  }

 private:
  struct Component {
    bool free = false;
    Pose frame_world;
    std::vector<VertexId> vertices = {};  // kept for free components only
    std::optional<Vec3> bed_point_world_m = {};
    Vec3 bed_normal_world = Vec3::UnitZ();

    template <class A>
    void archive(A& a) {
      a(free, frame_world, vertices, bed_point_world_m, bed_normal_world);
    }
  };

  void match(Component& component, std::span<const Vec3> rest_body_m, std::span<const double> mass_kg,
             std::span<const Vec4f> position_world_m);

  Pose body_world_;
  std::vector<Component> components_;
  std::vector<std::uint32_t> component_of_;
  std::vector<std::uint32_t> place_in_component_;  // index in Component::vertices, if the component is free
  std::vector<MatchedPoint> matched_;
};

}  // namespace sectio
