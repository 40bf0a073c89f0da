#include "sim_server/deformation/tetra/volume_engine.h"

#include <algorithm>

#include "common/core/error.h"

namespace sectio {

VolumeEngine::VolumeEngine(std::unique_ptr<VolumeModel> model, const TetMesh& mesh, std::uint32_t surface_vertices,
                           const Pose& body, std::optional<VolumeFloor> floor)
    : model_(std::move(model)),
      home_body_m_(mesh.vertices_body_m),
      surface_vertices_(surface_vertices),
      floor_(floor),
      frame_(body),
      position_(home_body_m_.size(), Vec4f::Zero()),
      velocity_(home_body_m_.size(), Vec4f::Zero()) {
  for (VertexId v = 0; v < position_.size(); ++v) position_[v].head<3>() = body.to_world(home_body_m_[v]).cast<float>();
  look_for_anchors();
}

void VolumeEngine::look_for_anchors() {
  anchored_ = false;
  for (VertexId v = 0; v < position_.size(); ++v) anchored_ = anchored_ || model_->inverse_mass_per_kg(v) == 0;
}

void VolumeEngine::exchange(std::unique_ptr<VolumeModel> model, const TetMesh& mesh, std::uint32_t surface_vertices,
                            std::vector<Vec4f> position_world_m, std::vector<Vec4f> velocity_m_per_s) {
  implicit_before_ += model_->implicit_steps();
  model->set_gravity(model_->gravity_m_per_s2());
  model_ = std::move(model);
  home_body_m_ = mesh.vertices_body_m;
  surface_vertices_ = surface_vertices;
  position_ = std::move(position_world_m);
  velocity_ = std::move(velocity_m_per_s);
  look_for_anchors();
}

void VolumeEngine::step(const SharedBody& body, std::span<const PointConstraint> constraints,
                        std::span<Reaction> reactions) {
  SECTIO_ASSERT(body.mesh.vertex_slots() == surface_vertices_, "the surface is that of the volume");
  ParticleState& outside = body.particles;
  for (VertexId v = 0; v < surface_vertices_; ++v) {
    position_[v].head<3>() = outside.position_world_m[v].head<3>();
    velocity_[v].head<3>() = outside.velocity_world_m_per_s[v].head<3>();
  }
  model_->step(position_, velocity_, constraints, reactions);
  if (floor_) stop_at_floor();
  for (VertexId v = 0; v < surface_vertices_; ++v) {
    outside.position_world_m[v].head<3>() = position_[v].head<3>();
    outside.velocity_world_m_per_s[v].head<3>() = velocity_[v].head<3>();
  }
  if (anchored_) return;
  matched_.clear();
  for (VertexId v = 0; v < position_.size(); ++v)
    matched_.push_back({home_body_m_[v], position_[v].head<3>().cast<double>(), model_->mass_kg(v)});
  frame_ = match_shape(matched_, frame_);
}

double VolumeEngine::energy_j(const SharedBody& body) const {
  std::vector<Vec4f> x = position_, v = velocity_;
  std::copy_n(body.particles.position_world_m.begin(), surface_vertices_, x.begin());
  std::copy_n(body.particles.velocity_world_m_per_s.begin(), surface_vertices_, v.begin());
  return model_->energy_j(x, v);
}

Pose VolumeEngine::home_frame_world(VertexId) const {
  return frame_;
}

void VolumeEngine::stop_at_floor() {
  const auto z = static_cast<float>(floor_->z_m), kept = static_cast<float>(floor_->kept_velocity);
  for (VertexId v = 0; v < position_.size(); ++v) {
    if (position_[v].z() >= z || model_->inverse_mass_per_kg(v) == 0) continue;
    position_[v].z() = z;
    velocity_[v].head<2>() *= kept;
    velocity_[v].z() = 0;
  }
}

}  // namespace sectio
