// Instruments that stroke a mesh at rest, without simulation: for tests of cutting alone, in either style.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "common/mesh/check.h"
#include "sim_server/surface/cutting/plan_cut.h"
#include "sim_server/surface/cutting/plan_template_cut.h"
#include "tests/support/mesh_at_rest.h"

namespace sectio::test {

// `Plan`: SurfaceCutPlan or TemplateCutPlan.
template <class Plan>
class BladesOnMesh : public MeshAtRest {
 public:
  explicit BladesOnMesh(const TriangleSoup& soup) : MeshAtRest(soup) {}
  virtual ~BladesOnMesh() = default;

  // The instrument enters at a point of a triangle.
  void enter(TriangleId triangle, const Vec3& bary, std::uint32_t edge_id = 0) {
    entries.push_back({edge_id, triangle, bary});
  }

  Plan step(const std::vector<BladeMotion>& motions) {
    Plan made_now = plan(over_all(motions));
    entries.clear();
    refused += made_now.refused;
    if (!accept(made_now)) {
      ++rejected_deltas;
      return made_now;
    }
    if (!made_now.delta.empty()) ++made;
    seed(made_now.seeds);
    return made_now;
  }

  // One tool, one pose: tip `depth_m` beneath `surface_point`, upright along `up`.
  Plan to(const Vec3& surface_point, const Vec3& up, double depth_m, bool lift = false) {
    return step({{0, {{surface_point - depth_m * up, up, 1e9}}, lift}});
  }
  Plan lift() { return step({{0, {}, true}}); }

  const auto* stroke() const { return cuts.stroke_of(0); }
  bool going() const { return stroke() != nullptr; }

  // The first flaw of the surface; empty: it is a closed manifold.
  virtual std::string flaw() const {
    const SurfaceReport r = check(mesh);
    return r.valid() ? std::string() : r.first_defect;
  }
  void expect_valid() const {
    const std::string found = flaw();
    ASSERT_TRUE(found.empty()) << found;
  }

  // Applies the delta and takes over the cuts of a plan. False when the delta does not fit: all strokes have ended.
  bool accept(const Plan& planned) {
    const bool fits = planned.delta.empty() || apply(planned.delta, mesh) == ApplyStatus::applied;
    if (fits)
      cuts = planned.after;
    else
      end_where_they_are(cuts);
    return fits;
  }

  // The motions with all triangles, any of which a blade may cross.
  std::vector<BladeMotion> over_all(std::vector<BladeMotion> motions) const {
    for (BladeMotion& m : motions)
      for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) m.active.push_back(t);
    return motions;
  }

  decltype(Plan::after) cuts;
  std::vector<Entry> entries;
  std::uint32_t refused = 0, rejected_deltas = 0, made = 0;

 private:
  virtual Plan plan(const std::vector<BladeMotion>& motions) const = 0;
};

// Instruments that cut with templates.
class TemplatesOnMesh : public BladesOnMesh<TemplateCutPlan> {
 public:
  using BladesOnMesh::BladesOnMesh;

 private:
  TemplateCutPlan plan(const std::vector<BladeMotion>& motions) const override {
    return plan_template_cut(mesh, view(), cuts, entries, motions, {});
  }
};

}  // namespace sectio::test
