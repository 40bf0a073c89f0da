// A part comes off over DDS on loopback: viewers learn of the new body, and never see it twice or not at all.
#include <gtest/gtest.h>

#include <map>

#include "sim_server/net/server_net.h"
#include "sim_server/net/world_view.h"
#include "tests/support/dds_session.h"
#include "tests/support/loop_cut.h"
#include "tests/support/patience.h"
#include "tests/support/replica_viewer.h"

namespace sectio::test {
namespace {

using TrianglesByStep = std::map<std::uint64_t, std::size_t>;  // triangles on the server, all bodies together

struct Viewer : ReplicaViewer {
  Viewer(const NetworkOptions& network, const TrianglesByStep& of_server)
      : ReplicaViewer(network), expected(of_server) {}

  void watch() {
    const bool is_new = look();
    saw_split |= std::ranges::any_of(
        net.events(), [](const SessionEvent& e) { return e.kind == static_cast<std::uint8_t>(EventKind::body_split); });
    if (!is_new) return;
    std::size_t triangles = 0;
    for (const BodyFrame& body : frame.bodies)
      triangles += static_cast<std::size_t>(std::ranges::count_if(body.triangles, &Triangle::alive));
    EXPECT_EQ(triangles, expected.at(frame.step)) << "of step " << frame.step;
  }
  bool agrees_with(const Simulation& simulation) {
    watch();
    std::vector<BodyVersion> versions;
    for (std::uint32_t b = 0; b < simulation.body_count(); ++b) versions.push_back(version_of(simulation.mesh(b)));
    return frame.bodies.size() == versions.size() && knows(versions);
  }

  const TrianglesByStep& expected;
  bool saw_split = false;
};

TEST(SplitOverDds, viewers_get_the_new_body_with_the_step_that_took_it_from_its_parent) {
  const NetworkOptions network = own_session();
  Operation op(loop_scene(FreeParts::rigid));
  ServerNet server({network, 1000, 1}, scene_info(op.scene), {op.mesh()});
  TrianglesByStep triangles;
  Viewer viewer(network, triangles);
  WorldView world;
  const auto publish = [&](const StepOutput& out) {
    view_world(op.simulation, op.scene.tools.size(), world);
    for (const WorldView::Body& body : world.bodies) triangles[out.step] += body.mesh->triangle_count();
    server.publish(out, world, 0.001);
    viewer.watch();
  };
  ASSERT_TRUE(wait_until([&] { return server.viewers() > 0; }));  // no step before: the cut is the same every time
  op.after_each = publish;
  cut_arc(op, 0, 375);
  lift(op);
  ASSERT_EQ(op.simulation.body_count(), 2u);
  EXPECT_TRUE(wait_until([&] {
    op.rest(1);
    return viewer.agrees_with(op.simulation);
  }));
  EXPECT_EQ(viewer.replica.body_names().at(1), op.simulation.body(1).name);
  EXPECT_TRUE(viewer.saw_split);
  EXPECT_GT(op.mesh(1).triangle_count(), 120u);

  Viewer late(network, triangles);
  EXPECT_TRUE(wait_until([&] {
    op.rest(1);
    return late.agrees_with(op.simulation);
  }));
  const SessionEnd end = server.end_session("complete");
  EXPECT_EQ(end.bodies.size(), 2u);
}

}  // namespace
}  // namespace sectio::test
