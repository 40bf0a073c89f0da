// Engines that a test names in a scene file: nothing of the product knows them. And such a scene.
#pragma once

#include <algorithm>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "sim_server/engine/engine_table.h"
#include "sim_server/surface/cutting/mesh_draft.h"

namespace sectio::test {

// A volume model: each particle of the volume keeps its place but for what instruments do, and creeps home.
class Clay final : public DeformationEngine {
 public:
  Clay(const TetMesh& tets, const Pose& frame, const MaterialSpec& material, double creep_per_s, double step_s)
      : frame_(frame), share_(creep_per_s * step_s), step_s_(step_s), mass_kg_(tets.vertices_body_m.size(), 0) {
    for (const Tetrahedron& t : tets.tetrahedra) {
      const auto& x = tets.vertices_body_m;
      const double volume_m3 = (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).dot(x[t[3]] - x[t[0]]) / 6;
      for (const VertexId v : t) mass_kg_[v] += material.density_kg_per_m3 * volume_m3 / 4;
    }
  }

  void follow(const SharedBody& body, const TopologyChange& change) override {
    mass_kg_.resize(std::max<std::size_t>(mass_kg_.size(), body.mesh.vertex_slots()), 0);
    for (const VertexId v : change.placed)
      if (mass_kg_[v] == 0) mass_kg_[v] = *std::ranges::max_element(mass_kg_);
  }
  void step(const SharedBody& body, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override {
    std::vector<double> inverse_mass(body.mesh.vertex_slots());
    for (VertexId v = 0; v < inverse_mass.size(); ++v) {
      if (!body.mesh.vertex_alive(v)) continue;
      inverse_mass[v] = inverse_mass_per_kg(v);
      const Vec3 x = body.particles.view().position(v);
      body.particles.place(v, x + share_ * (frame_.to_world(body.mesh.rest_body_m(v)) - x));
    }
    project(constraints, inverse_mass, step_s_, body.particles.position_world_m, body.particles.velocity_world_m_per_s,
            reactions);
  }

  void set_gravity(const Vec3&) override {}  // it is stiff enough to stand
  Pose rest_frame_world(VertexId) const override { return frame_; }
  void release(std::span<const VertexId>, const std::optional<SupportPlane>&) override {}
  bool fixed(VertexId) const override { return false; }
  double mass_kg(VertexId v) const override { return mass_kg_[v]; }
  double energy_j(const SharedBody&) const override { return 0; }
  double largest_stable_step_s() const override { return 1; }
  VertexId first_bad_vertex() const override { return kNone; }

 private:
  Pose frame_;
  double share_, step_s_;
  std::vector<double> mass_kg_;  // by vertex of the volume, those of the surface first
};

// Its own way to cut: a blade that breaks the surface leaves a prick, a new vertex in the triangle, and that is all.
class Pricking final : public CuttingEngine {
 public:
  CutTraits traits() const override { return {}; }
  CutPlan plan(const SharedBody& body, std::span<const Entry> entries, std::span<const BladeMotion>) const override {
    CutPlan plan;
    MeshDraft draft(body.mesh, body.particles.view());
    for (const Entry& entry : entries) {
      const Triangle t = draft.triangle(entry.triangle);
      if (!t.alive()) continue;
      const VertexId prick = draft.add_vertex(
          VertexState::mix({draft.state(t.v[0]), draft.state(t.v[1]), draft.state(t.v[2])}, entry.bary));
      const std::array<Triangle, 3> around{Triangle{{t.v[0], t.v[1], prick}, t.surface},
                                           Triangle{{t.v[1], t.v[2], prick}, t.surface},
                                           Triangle{{t.v[2], t.v[0], prick}, t.surface}};
      plan.outcomes.push_back({entry.edge_id, StrokeEnd::lifted});
      if (!draft.replace({&entry.triangle, 1}, around)) return {};
    }
    plan.delta = draft.delta();
    plan.seeds = draft.seeds();
    return plan;
  }
  void follow(const SharedBody&, const TopologyChange&) override {}
};

// Something within a body: it is warm, and publishes how warm.
class Warmth final : public ProcessEngine {
 public:
  Warmth(const SharedBody& body, double warms_k_per_s)
      : warms_k_per_s_(warms_k_per_s), above_k_(body.mesh.vertex_slots()) {}

  void follow(const SharedBody& body, const TopologyChange&) override { above_k_.resize(body.mesh.vertex_slots(), 0); }
  void step(const SharedBody&, double step_s) override {
    for (double& t : above_k_) t += warms_k_per_s_ * step_s;
  }
  bool moves_particles() const override { return false; }
  void publish(const SharedBody&, std::vector<ScalarField>& fields) const override {
    fields.push_back({"temperature", 0, 10, {above_k_.begin(), above_k_.end()}});
  }

 private:
  double warms_k_per_s_;
  std::vector<double> above_k_;
};

// Something between two bodies: water runs from the first one into the second, and wets both evenly.
class Leak final : public WorldEngine {
 public:
  Leak(std::span<const SharedBody> bodies, double water_ml, double flow_ml_per_s)
      : first_(bodies[0].id), flow_ml_per_s_(flow_ml_per_s), left_ml_(water_ml) {}

  void step(std::span<const SharedBody> bodies, double step_s) override {
    bodies_seen_ = bodies.size();
    const double ml = std::min(left_ml_, flow_ml_per_s_ * step_s);
    left_ml_ -= ml;
    arrived_ml_ += ml;
  }
  bool moves_particles() const override { return false; }
  void follow(const SharedBody&, const TopologyChange&) override { ++changes_; }
  void part_left(const SharedBody&, const SharedBody&, std::span<const VertexId>) override {}
  void publish(const SharedBody& body, std::vector<ScalarField>& fields) const override {
    const auto wet = static_cast<float>(body.id == first_ ? left_ml_ : arrived_ml_);
    fields.push_back({"wetness", 0, 2, std::vector<float>(body.mesh.vertex_slots(), wet)});
  }

  std::size_t bodies_seen() const { return bodies_seen_; }
  int changes() const { return changes_; }

 private:
  std::uint32_t first_;
  double flow_ml_per_s_, left_ml_, arrived_ml_ = 0;
  std::size_t bodies_seen_ = 0;
  int changes_ = 0;
};

EngineTable table_with_own_engines();

// Two cubes of 2 cm in a folder of their own: clay above, springs below; the lower one is warm, and water runs from one
// to the other. A scalpel has its tip where the test holds it.
class OwnEnginesScene {
 public:
  OwnEnginesScene();
  ~OwnEnginesScene();
  OwnEnginesScene(const OwnEnginesScene&) = delete;
  OwnEnginesScene& operator=(const OwnEnginesScene&) = delete;

  Scene load(const EngineTable& table) const { return load(table, text()); }
  Scene load(const EngineTable& table, const std::string& text) const;
  static std::string text();
  std::string folder() const { return folder_; }

 private:
  std::string folder_;
};

}  // namespace sectio::test
