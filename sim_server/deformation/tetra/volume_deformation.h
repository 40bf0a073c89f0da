// The deformation of a volume of tetrahedra. The rest of the simulation sees its surface only, in slots: each live slot
// is bound to a vertex of the volume.
//
// The body has the state of the vertices at the surface, which contacts and cuts change; this engine has the state of
// those inside. A model moves both in one array, so each step begins by reading the surface and ends by writing it.
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
  // `vertex_of`: the vertex of each slot of the surface. The model's mesh is at rest at the pose `body`.
  VolumeDeformation(std::unique_ptr<VolumeModel> model, std::vector<VertexId> vertex_of, const Pose& body,
                    std::optional<VolumeFloor> floor);

  void step(const SharedBody& body, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override;
  void set_gravity(const Vec3& gravity_m_per_s2) override { model_->set_gravity(gravity_m_per_s2); }
  // Does nothing: change() updates the surface together with the volume.
  void follow(const SharedBody&, const TopologyChange&) override {}
  Pose rest_frame_world(VertexId v) const override;
  void release(std::span<const VertexId>, const std::optional<SupportPlane>&) override {}

  // These take a slot of the surface.
  bool fixed(VertexId v) const override { return vertex_of_[v] != kNone && is_anchor(vertex_of_[v]); }
  double mass_kg(VertexId v) const override { return vertex_of_[v] == kNone ? 0 : model_->mass_kg(vertex_of_[v]); }
  double inverse_mass_per_kg(VertexId v) const override {
    return vertex_of_[v] == kNone ? 0 : model_->inverse_mass_per_kg(vertex_of_[v]);
  }
  double layer_m() const override { return layer_m_; }
  double energy_j(const SharedBody& body) const override;
  double largest_stable_step_s() const override { return model_->largest_stable_step_s(); }
  IntegratorDiagnostics diagnostics() const override { return model_->diagnostics(); }
  VertexId first_bad_vertex() const override { return model_->first_bad_vertex(); }
  void save(DeformationState& state) const override;
  void restore(const SharedBody& body, const DeformationState* state) override;
  void use_stable_driver(int steps) override { model_->use_stable_driver(steps); }

  // Follows a change of the volume: the state of the added vertices (from TetChange::first_added on), and the slots
  // that are bound to another vertex, or to none. Call before the next step(), whose body has the new surface.
  // O(change).
  struct Slot {
    VertexId slot, vertex;  // vertex kNone: the slot is dead
  };
  void change(const TetChange& change, std::span<const Vec4f> added_position_world_m,
              std::span<const Vec4f> added_velocity_m_per_s, std::span<const Slot> slots);
  // These are for vertices without a slot; the state of the others is the body's.
  void place_inside(VertexId v, const Vec3& position_world_m, const Vec3& velocity_m_per_s) {
    position_[v].head<3>() = position_world_m.cast<float>();
    velocity_[v].head<3>() = velocity_m_per_s.cast<float>();
  }
  void nudge_inside(VertexId v, const Vec3& faster_by_m_per_s) {
    velocity_[v].head<3>() += faster_by_m_per_s.cast<float>();
  }
  // Sets the state of all vertices, for a part that comes off another volume.
  void set_state(std::vector<Vec4f> position_world_m, std::vector<Vec4f> velocity_m_per_s);

  const VolumeModel& model() const { return *model_; }
  // The state of all vertices, those at the surface as they were after the last step.
  std::span<const Vec4f> position_world_m() const { return position_; }
  std::span<const Vec4f> velocity_m_per_s() const { return velocity_; }

 private:
  bool is_there(VertexId v) const { return model_->mass_kg(v) > 0; }
  bool is_anchor(VertexId v) const { return model_->inverse_mass_per_kg(v) == 0 && is_there(v); }
  void read_surface_state(const ParticleState& outside);
  void rebind(const Slot& slot);
  void stand_on_floor();
  void stop_at_floor(std::size_t first);  // first: number of the floor's first constraint

  std::unique_ptr<VolumeModel> model_;
  std::vector<VertexId> vertex_of_;     // by slot
  std::vector<VertexId> shared_slots_;  // slots bound to a vertex that another slot had before; ascending
  std::vector<std::uint8_t> slots_of_;  // by vertex: number of slots
  std::optional<VolumeFloor> floor_;
  double layer_m_ = 0;  // before cuts have made small elements
  std::size_t anchors_ = 0;
  Pose frame_, first_frame_;
  std::vector<Vec4f> position_, velocity_;  // by vertex; at the surface a step reads them from the body
  VertexSet touched_;                       // scratch
  std::vector<MatchedPoint> matched_;
  std::vector<PointConstraint> constraints_;
  std::vector<Reaction> reactions_;
};

}  // namespace sectio
