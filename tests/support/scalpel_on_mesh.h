// An instrument that strokes a mesh at rest, without simulation: for tests of cutting alone.
#pragma once

#include <gtest/gtest.h>

#include "common/mesh/check.h"
#include "sim_server/cutting/plan_cut.h"

namespace sectio::test {

class ScalpelOnMesh {
 public:
  explicit ScalpelOnMesh(const TriangleSoup& soup, StrokeSettings s = {}) : mesh(soup), settings(s) { seed({}); }

  // The instrument enters at a point of a triangle.
  void enter(TriangleId triangle, const Vec3& bary, std::uint32_t tool_id = 0) {
    entries.push_back({tool_id, triangle, bary});
  }

  CutPlan step(const std::vector<BladeMotion>& motions) {
    const ParticleView view{positions.data(), velocities.data()};
    CutPlan plan = plan_cut(mesh, view, cuts, entries, motions, settings, true);
    entries.clear();
    refused += plan.refused;
    if (!accept(plan, mesh, cuts)) {
      ++rejected_deltas;
      return plan;
    }
    if (!plan.delta.empty()) ++made;
    seed(plan.seeds);
    return plan;
  }

  // One tool, one pose: tip `depth_m` beneath `surface_point`, upright along `up`.
  CutPlan to(const Vec3& surface_point, const Vec3& up, double depth_m, bool lift = false) {
    return step({{0, {{surface_point - depth_m * up, up, 1e9}}, lift}});
  }
  CutPlan lift() { return step({{0, {}, true}}); }

  const Stroke* stroke() const { return cuts.stroke_of(0); }
  bool going() const { return stroke() != nullptr; }

  void expect_valid() const {
    const SurfaceReport r = check(mesh);
    ASSERT_TRUE(r.valid()) << r.first_defect;
  }

  TriangleMesh mesh;
  StrokeSettings settings;
  BodyCuts cuts;
  std::vector<Entry> entries;
  std::vector<float> positions, velocities;
  std::uint32_t refused = 0, rejected_deltas = 0, made = 0;

 private:
  void seed(const std::vector<std::pair<VertexId, VertexState>>& seeds) {
    const std::size_t known = positions.size() / 4;
    positions.resize(mesh.vertex_slots() * 4);
    velocities.resize(mesh.vertex_slots() * 4);
    for (std::size_t v = known; v < mesh.vertex_slots(); ++v) place(v, mesh.rest_body_m(static_cast<VertexId>(v)));
    for (const auto& [v, state] : seeds) place(v, state.position_world_m);
  }
  void place(std::size_t v, const Vec3& x) {
    for (int i = 0; i < 3; ++i) positions[4 * v + static_cast<std::size_t>(i)] = static_cast<float>(x[i]);
  }
};

}  // namespace sectio::test
