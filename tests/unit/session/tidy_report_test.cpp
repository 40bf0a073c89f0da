// The count in report.json of the short edges that collapse after a cut.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "sim_server/engine/standard_engines.h"
#include "sim_server/session/recorder.h"
#include "sim_server/volume/volume_cutting.h"
#include "tests/support/operation.h"
#include "tests/support/shapes.h"

namespace sectio::session_test {
namespace {

// A bar that stands on the table.
Scene bar_under_knife(double collapse_ratio) {
  Scene scene;
  BodySpec& bar = scene.bodies.emplace_back();
  bar.name = "bar";
  bar.model = "neo_hookean";
  bar.mesh = test::box(3, 3, 6, Vec3(0.02, 0.02, 0.04));
  bar.pose.position_m = Vec3(-0.01, -0.01, 0);
  bar.volume.tetrahedra = 1000;
  bar.volume.least_part_s = 1e-4;
  bar.volume.collapse_ratio = collapse_ratio;
  bar.cutting.style = "semi_progressive";
  bar.cutting.threshold_force_n = 0.005;
  bar.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.004)};
  ToolSpec& knife = scene.tools.emplace_back();
  knife.name = "knife";
  knife.kind = "knife";
  knife.geometry.b_tool_m = Vec3(0, 0, 0.06);
  knife.geometry.c_tool_m = Vec3(0.002, 0, 0.05);
  knife.geometry.d_tool_m = Vec3(0.002, 0, 0.06);
  knife.geometry.sharp_length_m = 0.045;
  return scene;
}

struct Tidied {
  std::uint64_t vertices_gone = 0;  // vertices of the volume, counted by the cutting engine, in steps without a cut
  std::uint64_t reported = 0;
  nlohmann::json run;
};

// The edge lies along x and goes through a part of the bar, out again, and then the bar is left alone.
Tidied cut_and_rest(double collapse_ratio) {
  EngineTable table = standard_engines();
  const VolumeCutting* cutting = nullptr;
  table.model("neo_hookean").make = [&, make = table.model("neo_hookean").make](const EngineSite& site) {
    BodyEngines engines = make(site);
    cutting = &dynamic_cast<const VolumeCutting&>(*engines.cutting);
    return engines;
  };
  test::Operation op(bar_under_knife(collapse_ratio), table);
  Recorder record(op.scene, op.simulation, "");
  op.simulation.measure_with([] { return 0.0; });
  const auto vertices = [&] {
    std::uint64_t n = 0;
    for (VertexId v = 0; v < cutting->volume().vertex_count(); ++v) n += cutting->volume().alive(v);
    return n;
  };
  Tidied result;
  std::uint64_t before = vertices(), cuts = 0;
  op.after_each = [&](const StepOutput& out) {
    record.add(out, 0);
    const std::uint64_t now = vertices();
    if (out.report.cuts_made == cuts) result.vertices_gone += before - now;
    cuts = out.report.cuts_made;
    before = now;
  };
  Mat3 edge_along_x;
  edge_along_x << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  op.place(Vec3(-0.02, -0.015, 0.025), Eigen::Quaterniond(edge_along_x));
  op.move(Vec3(-0.02, 0.002, 0.025), 0.04);
  EXPECT_GT(op.last.report.cuts_made, 0u);
  op.move(Vec3(-0.02, -0.03, 0.025), 0.4);
  op.rest(300);
  result.reported = op.last.report.edges_collapsed;
  result.run = nlohmann::json::parse(record.finish().report)["run"];
  return result;
}

TEST(C_LIM, C_LIM_1_the_report_counts_edges_that_collapsed_after_cuts) {
  const Tidied tidied = cut_and_rest(0.5);
  EXPECT_GT(tidied.vertices_gone, 0u);
  EXPECT_EQ(tidied.reported, tidied.vertices_gone);
  EXPECT_EQ(tidied.run.at("edges_collapsed"), tidied.vertices_gone);
  EXPECT_EQ(cut_and_rest(0).run.at("edges_collapsed"), 0);
}

}  // namespace
}  // namespace sectio::session_test
