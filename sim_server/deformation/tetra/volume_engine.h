// A volume of tetrahedra behind the surface that the rest of the simulation sees: the surface's vertices are the first
// ones of the volume, and what happens to them outside is taken over at the start of each step. Its inside stays here.
#pragma once

#include <memory>

#include "sim_server/deformation/deformation_engine.h"
#include "sim_server/deformation/home_frame.h"
#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio {

// A horizontal floor for all vertices, the inner ones included (paper C, 3.1): what gets below it is put onto it; its
// velocity is left this fraction of what it was along the floor: 0 is high friction.
struct VolumeFloor {
  double z_m = 0;
  double kept_velocity = 0;
};

class VolumeEngine final : public DeformationEngine {
 public:
  // `mesh`: vertices of the surface first, `surface_vertices` of them; at rest it is at `body`.
  VolumeEngine(std::unique_ptr<VolumeModel> model, const TetMesh& mesh, std::uint32_t surface_vertices,
               const Pose& body, std::optional<VolumeFloor> floor);

  void step(const SharedBody& body, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override;
  void set_gravity(const Vec3& gravity_m_per_s2) override { model_->set_gravity(gravity_m_per_s2); }
  // The surface's topology changes with the volume's: see exchange().
  void follow(const SharedBody&, const TopologyChange&) override {}
  Pose home_frame_world(VertexId v) const override;
  void release(std::span<const VertexId>, const std::optional<Bed>&) override {}

  bool fixed(VertexId v) const override { return model_->inverse_mass_per_kg(v) == 0; }
  double mass_kg(VertexId v) const override { return model_->mass_kg(v); }
  double inverse_mass_per_kg(VertexId v) const override { return model_->inverse_mass_per_kg(v); }
  double energy_j(const SharedBody& body) const override;
  double largest_stable_step_s() const override { return model_->largest_stable_step_s(); }
  double added_mass_fraction() const override { return model_->added_mass_fraction(); }
  VertexId first_bad_vertex() const override { return model_->first_bad_vertex(); }
  std::uint64_t implicit_steps() const override { return implicit_before_ + model_->implicit_steps(); }

  // The volume has been cut: from now on it is this one, with its state, in the gravity that there is; vertices of the
  // surface first again. Before the next step(), whose body has that surface.
  void exchange(std::unique_ptr<VolumeModel> model, const TetMesh& mesh, std::uint32_t surface_vertices,
                std::vector<Vec4f> position_world_m, std::vector<Vec4f> velocity_m_per_s);

  const VolumeModel& model() const { return *model_; }
  // Of the inside; those of the surface are the body's.
  std::span<const Vec4f> position_world_m() const { return position_; }
  std::span<const Vec4f> velocity_m_per_s() const { return velocity_; }

 private:
  void stop_at_floor();
  void look_for_anchors();

  std::unique_ptr<VolumeModel> model_;
  std::vector<Vec3> home_body_m_;
  std::uint32_t surface_vertices_;
  std::optional<VolumeFloor> floor_;
  bool anchored_ = false;
  std::uint64_t implicit_before_ = 0;  // of models before a cut
  Pose frame_;
  std::vector<Vec4f> position_, velocity_;
  std::vector<MatchedPoint> matched_;
};

}  // namespace sectio
