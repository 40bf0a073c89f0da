// A part comes off over DDS on loopback: viewers learn of the new body, and never see it twice or not at all.
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <thread>

#include "render_client/net/client_net.h"
#include "sim_server/net/server_net.h"
#include "sim_server/net/world_view.h"
#include "tests/support/dds_session.h"
#include "tests/support/loop_cut.h"

namespace sectio::test {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds kGiveUp{30};

using TrianglesByStep = std::map<std::uint64_t, std::size_t>;  // that the server had, of all bodies

struct Viewer {
  Viewer(const NetworkOptions& network, const TrianglesByStep& of_server) : net(network), expected(of_server) {}

  void look() {
    const double now_s = std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
    net.poll(now_s, replica);
    saw_split |= std::ranges::any_of(
        net.events(), [](const SessionEvent& e) { return e.kind == static_cast<std::uint8_t>(EventKind::body_split); });
    if (!replica.frame(now_s, frame)) return;
    std::size_t triangles = 0;
    for (const BodyFrame& body : frame.bodies)
      triangles += static_cast<std::size_t>(std::ranges::count_if(body.triangles, &Triangle::alive));
    EXPECT_EQ(triangles, expected.at(frame.step)) << "of step " << frame.step;
  }
  bool agrees_with(const Simulation& simulation) {
    look();
    if (replica.bodies().size() != simulation.body_count()) return false;
    if (frame.bodies.size() != simulation.body_count()) return false;
    const std::vector<BodyVersion> versions = replica.catch_up();
    for (std::uint32_t b = 0; b < versions.size(); ++b)
      if (!replica.bodies()[b]->known() || versions[b].topology_hash != simulation.mesh(b).hash()) return false;
    return true;
  }

  ClientNet net;
  const TrianglesByStep& expected;
  World replica;
  Frame frame;
  bool saw_split = false;
};

template <class Condition>
bool wait_until(const Condition& condition) {
  const auto end = Clock::now() + kGiveUp;
  while (!condition()) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

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
    viewer.look();
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
