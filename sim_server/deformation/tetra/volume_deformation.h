// The deformation of a volume of tetrahedra. The rest of the simulation sees its surface only, in slots: each live slot
// is bound to a vertex of the volume.
//
// The body's particles are the vertices of the volume, those inside included, and a model moves them where they are
// stored. This engine keeps the table by which a slot finds its particle.
#pragma once

#include <memory>

#include "sim_server/deformation/deformation_engine.h"
#include "sim_server/deformation/shape_matching.h"
#include "sim_server/deformation/tetra/vertex_set.h"
#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio {

// A horizontal floor for all vertices, inner ones included (paper C, 3.1). A vertex that gets below the floor is put
// onto it and keeps this fraction of its velocity along the floor; 0 is high friction.
struct VolumeFloor {
  double z_m = 0;
  double kept_velocity = 0;
};

class VolumeDeformation final : public DeformationEngine {
 public:
  // `vertex_of`: the vertex of each slot of the surface. The model's mesh is at rest at the pose `body`, and so are the
  // body's particles from now on.
  VolumeDeformation(std::unique_ptr<VolumeModel> model, std::vector<VertexId> vertex_of, const Pose& body,
                    std::optional<VolumeFloor> floor, ParticleState& particles);

  void step(const SharedBody& body, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override;
  void set_gravity(const Vec3& gravity_m_per_s2) override { model_->set_gravity(gravity_m_per_s2); }
  // Does nothing: change() has followed already.
  void follow(const SharedBody&, const TopologyChange&) override {}
  Pose rest_frame_world(VertexId v) const override;
  void release(std::span<const VertexId>, const std::optional<SupportPlane>&) override {}

  // These take a slot of the surface.
  bool fixed(VertexId v) const override { return vertex_of_[v] != kNone && is_anchor(vertex_of_[v]); }
  double mass_kg(VertexId v) const override { return vertex_of_[v] == kNone ? 0 : model_->mass_kg(vertex_of_[v]); }
  double inverse_mass_per_kg(VertexId v) const override {
    return vertex_of_[v] == kNone ? 0 : model_->inverse_mass_per_kg(vertex_of_[v]);
  }
  void nodes_of(VertexId v, std::vector<NodeShare>& nodes) const override {
    nodes.clear();
    if (vertex_of_[v] != kNone) model_->nodes_of(vertex_of_[v], nodes);
  }
  std::uint32_t node_count(const ParticleView&) const override { return model_->node_count(); }
  NodeMotion node(const ParticleView& particles, std::uint32_t n) const override {
    return model_->node(particles.velocity_world_m_per_s, n);
  }
  void nudge(const SharedBody& body, std::span<const NodeChange> changes) override {
    model_->nudge(changes, body.particles.position_world_m, body.particles.velocity_world_m_per_s);
  }
  double layer_m() const override { return layer_m_; }
  double energy_j(const SharedBody& body) const override;
  double largest_stable_step_s() const override { return model_->largest_stable_step_s(); }
  IntegratorDiagnostics diagnostics() const override { return model_->diagnostics(); }
  ModelSize size(const SharedBody&) const override { return model_->size(); }
  std::vector<SagPoint> sag(const Vec3& gravity_body_m_per_s2) override { return model_->sag(gravity_body_m_per_s2); }
  VertexId first_bad_vertex() const override { return model_->first_bad_vertex(); }
  void save(DeformationState& state) const override;
  void restore(const SharedBody& body, const DeformationState* state) override;
  void use_stable_driver(int steps) override { model_->use_stable_driver(steps); }
  void archive(Archive& a, const SharedBody&) override {
    model_->archive(a);
    a(vertex_of_, layer_m_, anchors_, frame_, first_frame_);
  }

  // Follows a change of the volume, and binds slots to another vertex, or to none. The caller places the vertices that
  // are added (from TetChange::first_added on). Call before the next step(). O(change).
  struct Slot {
    VertexId slot, vertex;  // vertex kNone: the slot is dead
  };
  void change(const SharedBody& body, const TetChange& change, std::span<const Slot> slots);

  const VolumeModel& model() const { return *model_; }

 private:
  bool is_there(VertexId v) const { return model_->mass_kg(v) > 0; }
  bool is_anchor(VertexId v) const { return model_->inverse_mass_per_kg(v) == 0 && is_there(v); }
  void stand_on_floor(const ParticleState& particles);
  void stop_at_floor(ParticleState& particles, std::size_t first);  // first: number of the floor's first constraint

  std::unique_ptr<VolumeModel> model_;
  std::vector<VertexId> vertex_of_;  // by slot; kNone where it is dead
  std::optional<VolumeFloor> floor_;
  double layer_m_ = 0;  // before cuts have made small elements
  std::size_t anchors_ = 0;
  Pose frame_, first_frame_;
  VertexSet touched_;  // scratch
  std::vector<MatchedPoint> matched_;
  std::vector<PointConstraint> constraints_;
  std::vector<Reaction> reactions_;
};

}  // namespace sectio
