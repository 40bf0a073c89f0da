#include "sim_server/deformation/rest_frames.h"

#include "common/mesh/slot_table.h"
#include "sim_server/deformation/deformation_engine.h"

namespace sectio {
namespace {

constexpr double kBedFriction = 0.5;

}  // namespace

RestFrames::RestFrames(const Pose& body_world) : body_world_(body_world), components_{{false, body_world}} {}

void RestFrames::resize(std::uint32_t vertex_slots) {
  for (auto* components : {&component_of_, &place_in_component_}) resize_slots(*components, vertex_slots, kNone);
}

void RestFrames::move(VertexId v, std::uint32_t component) {
  const std::uint32_t old = component_of_[v];
  if (old != kNone && components_[old].free) {
    std::vector<VertexId>& members = components_[old].vertices;
    members[place_in_component_[v]] = members.back();
    place_in_component_[members.back()] = place_in_component_[v];
    members.pop_back();
  }
  component_of_[v] = component;
  if (component == kNone || !components_[component].free) return;
  place_in_component_[v] = static_cast<std::uint32_t>(components_[component].vertices.size());
  components_[component].vertices.push_back(v);
}

void RestFrames::set(std::uint32_t component, std::span<const VertexId> vertices, bool free) {
  const Pose parent_world = components_[component_of_[vertices.front()]].frame_world;
  if (component >= components_.size()) components_.resize(component + 1, Component{false, body_world_});
  // Take the vertices out of lists kept under the old state before the state changes.
  for (const VertexId v : vertices) move(v, kNone);
  Component& c = components_[component];
  if (!free) c.frame_world = body_world_;
  if (free && !c.free) c.frame_world = parent_world;
  c.free = free;
  for (const VertexId v : vertices) move(v, component);
  matched_.reserve(c.vertices.size());
}

void RestFrames::set_bed(std::uint32_t component, const Vec3& point_world_m, const Vec3& normal_world) {
  components_[component].bed_point_world_m = point_world_m;
  components_[component].bed_normal_world = normal_world.normalized();
}

void RestFrames::match(Component& c, std::span<const Vec3> rest_body_m, std::span<const double> mass_kg,
                       std::span<const Vec4f> position_world_m) {
  matched_.clear();
  for (const VertexId v : c.vertices)
    matched_.push_back({rest_body_m[v], position_world_m[v].head<3>().cast<double>(), mass_kg[v]});
  c.frame_world = match_shape(matched_, c.frame_world);
}

void RestFrames::stop_at_beds(double step_s, std::span<Vec4f> position_world_m,
                              std::span<Vec4f> velocity_m_per_s) const {
  for (const Component& c : components_) {
    if (!c.free || !c.bed_point_world_m) continue;
    for (const VertexId v : c.vertices) {
      const Vec3 at = position_world_m[v].head<3>().cast<double>();
      const double height_m = (at - *c.bed_point_world_m).dot(c.bed_normal_world);
      if (height_m >= 0) continue;
      const Vec3 moved_m = step_s * velocity_m_per_s[v].head<3>().cast<double>();
      const Vec3 slid_m = moved_m - moved_m.dot(c.bed_normal_world) * c.bed_normal_world;
      const double most_m = -kBedFriction * height_m, far_m = slid_m.norm();
      const Vec3 back_m = far_m > most_m ? Vec3(most_m / far_m * slid_m) : slid_m;
      position_world_m[v].head<3>() = (at - height_m * c.bed_normal_world - back_m).cast<float>();
      velocity_m_per_s[v].setZero();
    }
  }
}

std::vector<Pose> RestFrames::save() const {
  std::vector<Pose> frames_world;
  for (const Component& c : components_) frames_world.push_back(c.frame_world);
  return frames_world;
}

void RestFrames::restore(std::span<const Pose> frames_world) {
  for (std::size_t i = 0; i < components_.size(); ++i) {
    if (i < frames_world.size())
      components_[i].frame_world = frames_world[i];
    else if (!is_finite(components_[i].frame_world))
      components_[i].frame_world = body_world_;
  }
}

}  // namespace sectio
