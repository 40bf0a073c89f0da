// Engines that only tests have: nothing in sim_server knows them.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <vector>

#include "sim_server/engine/engine_table.h"

namespace sectio::test {

using Neighbours = std::map<VertexId, std::set<VertexId>>;

Neighbours neighbours_of(const TriangleMesh& mesh);

// Cut walls bleed, and blood runs along edges. A representation of its own beside the mesh: vessels, a list of
// neighbours for each vertex, and the blood on each.
class Bleeding final : public ProcessEngine {
 public:
  static constexpr double kRate_ml_per_s = 0.01;  // rate of a vertex of a wall
  static constexpr double kSpreading_per_s = 5;

  explicit Bleeding(const SharedBody& body);
  // For a part, which takes its share of the blood along.
  Bleeding(const SharedBody& part, const Bleeding& parent, std::span<const VertexId> vertex_from);

  void follow(const SharedBody& body, const TopologyChange& change) override;

  bool moves_particles() const override { return false; }
  void step(const SharedBody&, double step_s) override;

  const Neighbours& vessels() const { return vessels_; }
  const std::vector<double>& blood_ml() const { return blood_ml_; }
  double bled_ml() const { return bled_ml_; }  // by this body
  double lost_ml() const { return lost_ml_; }  // with vertices that are gone

 private:
  void reconnect(const TriangleMesh& mesh, VertexId v);
  void find_wounds(const TriangleMesh& mesh);

  Neighbours vessels_;
  std::vector<double> blood_ml_;
  std::set<VertexId> wounds_;
  double bled_ml_ = 0, lost_ml_ = 0;
};

// Another integrator: velocity Verlet on home springs and one spring an edge, with the accelerations of the last step.
class Verlet final : public DeformationEngine {
 public:
  Verlet(const SharedBody& body, const Pose& frame, const BodySpec& spec, double step_s);

  void follow(const SharedBody& body, const TopologyChange& change) override;

  void set_gravity(const Vec3&) override {}  // it has no weight

  void step(const SharedBody& body, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override;

  Pose rest_frame_world(VertexId) const override { return frame_; }
  void release(std::span<const VertexId>, const std::optional<SupportPlane>&) override {}
  bool fixed(VertexId v) const override { return fixed_[v]; }
  double mass_kg(VertexId) const override { return kMass_kg; }
  double largest_stable_step_s() const override;
  VertexId first_bad_vertex() const override { return kNone; }
  double energy_j(const SharedBody& body) const override;
  std::uint64_t steps() const { return steps_; }

 private:
  static constexpr double kMass_kg = 1e-3, kHome_n_per_m = 10, kEdge_n_per_m = 8, kDrag = 0.05;
  static constexpr double kPretension = 0.2;

  static Vec3 position(const SharedBody& body, VertexId v);
  static Vec3 velocity(const SharedBody& body, VertexId v);

  void accelerate(const SharedBody& body);

  void add_points(const SharedBody& body);

  Pose frame_;
  std::optional<Box> fixed_box_;
  double step_s_;
  std::vector<Vec3> acceleration_;  // m/s2
  std::vector<bool> fixed_;
  std::uint64_t steps_ = 0;
};

// Asks every triangle, and keeps nothing.
class EveryTriangle final : public CollisionEngine {
 public:
  explicit EveryTriangle(const SurfaceView& view) { moved(view); }

  void follow(const SharedBody& body, const TopologyChange&) override;
  void moved(const SurfaceView& view) override;
  Box3 bounds_world_m() const override { return bounds_; }
  std::vector<SurfaceHit> hits(const SurfaceView& view, const Vec3& p, const Vec3& q) const override;
  std::optional<SurfaceHit> first_hit(const SurfaceView& view, const Vec3& p, const Vec3& q) const override;
  bool inside(const SurfaceView& view, const Vec3& point) const override;
  std::optional<ClosestSurfacePoint> closest(const SurfaceView& view, const Vec3& point,
                                             double within_m) const override;
  void near_segments(const SurfaceView& view, std::span<const Vec3> points,
                     std::span<const std::array<std::size_t, 2>> segments, double reach_m,
                     std::vector<TriangleId>& out) const override;

 private:
  template <class Use>
  static void each(const SurfaceView& view, const Use& use) {
    for (TriangleId t = 0; t < view.mesh.triangle_slots(); ++t)
      if (view.mesh.triangle(t).alive()) use(t);
  }
  Box3 bounds_;
};

}  // namespace sectio::test
