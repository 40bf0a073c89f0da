// Paper A, 2.3: highly concave results. The lips of a deep cut are squeezed together and do not pass through each
// other.
#include <gtest/gtest.h>

#include <map>

#include "sim_server/deformation/deformation_engine.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/surface/surface_engines.h"
#include "tests/support/operation.h"

namespace sectio::test {
namespace {

// Presses both sides of a cut along the x axis together, as strong hands would.
class Squeeze final : public ProcessEngine {
 public:
  explicit Squeeze(const double& m_per_s2) : m_per_s2_(m_per_s2) {}
  void follow(const SharedBody&, const TopologyChange&) override {}
  void step(const SharedBody& body, double step_s) override {
    if (m_per_s2_ == 0) return;
    // By the walls' own side: the corners that wall triangles of the left and of the right side share don't move.
    for (VertexId v = 0; v < body.mesh.vertex_slots(); ++v) {
      if (!body.mesh.vertex_alive(v)) continue;
      const double side = side_of(body.mesh, v), away_m = std::abs(body.mesh.rest_body_m(v).y());
      if (away_m > 0.02 || body.mesh.rest_body_m(v).z() < 0) continue;
      body.particles.velocity_world_m_per_s[v].y() -= static_cast<float>(step_s * side * m_per_s2_);
    }
  }

  // The direction of the tissue around a vertex.
  static double side_of(const TriangleMesh& mesh, VertexId v) {
    double sum = 0;
    for (const TriangleId t : mesh.fan(v))
      for (const VertexId w : mesh.triangle(t).v) sum += mesh.rest_body_m(w).y();
    return std::abs(sum) < 1e-6 ? 0 : sum > 0 ? 1 : -1;
  }

 private:
  const double& m_per_s2_;
};

// The deformation engine as it was made, but contacts can't move the body.
class Untouchable final : public DeformationEngine {
 public:
  explicit Untouchable(std::unique_ptr<DeformationEngine> e) : engine_(std::move(e)) {}
  double inverse_mass_per_kg(VertexId) const override { return 0; }

  void follow(const SharedBody& body, const TopologyChange& change) override { engine_->follow(body, change); }
  void step(const SharedBody& body, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override {
    engine_->step(body, constraints, reactions);
  }
  void set_gravity(const Vec3& gravity_m_per_s2) override { engine_->set_gravity(gravity_m_per_s2); }
  Pose rest_frame_world(VertexId v) const override { return engine_->rest_frame_world(v); }
  void release(std::span<const VertexId> piece, const std::optional<SupportPlane>& bed) override {
    engine_->release(piece, bed);
  }
  bool fixed(VertexId v) const override { return engine_->fixed(v); }
  double mass_kg(VertexId v) const override { return engine_->mass_kg(v); }
  double energy_j(const SharedBody& body) const override { return engine_->energy_j(body); }
  double largest_stable_step_s() const override { return engine_->largest_stable_step_s(); }
  VertexId first_bad_vertex() const override { return engine_->first_bad_vertex(); }

 private:
  std::unique_ptr<DeformationEngine> engine_;
};

EngineTable engines(const double& squeeze_m_per_s2, bool with_lips) {
  EngineTable table = standard_engines();
  table.model("surface_springs").make = [&squeeze_m_per_s2, with_lips](const EngineSite& site) {
    BodyEngines e = surface_spring_engines(site);
    if (!with_lips) e.deformation = std::make_unique<Untouchable>(std::move(e.deformation));
    e.processes.insert(e.processes.begin(), std::make_unique<Squeeze>(squeeze_m_per_s2));
    return e;
  };
  return table;
}

// How far the two lips of a cut along the x axis have passed each other: vertices of both sides that were at one place.
double passed_through_m(const TriangleMesh& mesh, PositionsView positions) {
  std::map<std::array<double, 3>, std::array<double, 2>> places;  // at rest -> y now of the left and of the right lip
  double most_m = 0;
  int pairs = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (!mesh.vertex_alive(v)) continue;
    const Vec3& rest = mesh.rest_body_m(v);
    const double side = Squeeze::side_of(mesh, v);
    if (side == 0) continue;
    const double here = positions[v].y(), none = 1e9;
    const auto [it, is_new] = places.try_emplace({rest.x(), rest.y(), rest.z()}, std::array{none, none});
    it->second[side > 0] = here;
    if (it->second[0] == none || it->second[1] == none) continue;
    ++pairs;
    most_m = std::max(most_m, it->second[0] - it->second[1]);
  }
  EXPECT_GE(pairs, 10);
  return most_m;
}

struct Squeezed {
  explicit Squeezed(bool with_lips, const char* style = "progressive")
      : op(scene(style), engines(m_per_s2, with_lips)) {
    op.place({-0.02, 0, kOrganTop_m + 0.005});
    op.tip_to(-0.018, 0, 0.008);
    op.tip_to(0.018, 0, 0.008);
    op.move(op.hand().position_m + Vec3(0, 0, 0.03), 0.1);
    EXPECT_GT(op.walls(), 40u);
    op.rest(300);
  }
  static Scene scene(const char* style) {
    Scene s = organ_scene();
    s.bodies[0].mesh = ellipsoid(4, Vec3(0.06, 0.06, kOrganTop_m));
    s.bodies[0].cutting.style = style;
    return s;
  }
  double passed_m() const { return passed_through_m(op.mesh(), op.simulation.positions_world_m(0)); }

  double m_per_s2 = 0;
  Operation op;
};

TEST(A_SEQ, A_SEQ_8_lips_of_a_deep_cut_that_are_squeezed_together_do_not_pass_through_each_other) {
  constexpr double kTolerance_m = 3e-4;
  Squeezed with(true), without(false);
  for (Squeezed* s : {&with, &without}) {
    s->m_per_s2 = 40;  // four times gravity; much more, and one lip rides up on the other
    s->op.rest(400);
  }
  EXPECT_GT(without.passed_m(), 5 * kTolerance_m) << "the squeeze is strong enough";
  EXPECT_LT(with.passed_m(), kTolerance_m);
  with.m_per_s2 = 0;
  with.op.rest(600);
  EXPECT_LT(with.passed_m(), kTolerance_m);
}

}  // namespace
}  // namespace sectio::test
