// Server, viewers and bridge in one process, over DDS on loopback.
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <thread>

#include "common/core/error.h"
#include "common/messages/epoch.h"
#include "device_bridge/net/bridge_net.h"
#include "sim_server/net/server_net.h"
#include "sim_server/net/world_view.h"
#include "sim_server/simulation.h"
#include "tests/support/dds_session.h"
#include "tests/support/moving_world.h"
#include "tests/support/patience.h"
#include "tests/support/replica_viewer.h"
#include "tests/support/scene_engines.h"

namespace sectio {
namespace {

using test::MovingWorld;
using test::own_session;
using Viewer = test::ReplicaViewer;

class Replication : public testing::Test {
 protected:
  void open(const NetworkOptions& options, int levels = 3) {
    network = options;
    world = std::make_unique<MovingWorld>(levels);
    ServerNetOptions server_options{network, 1000, first_epoch(++epoch)};
    server = std::make_unique<ServerNet>(server_options, world->scene(network.session), std::vector{world->mesh()});
  }

  void step(bool cut) {
    const StepOutput output = world->step(cut);
    server->publish(output, world->view(), 0.001);
  }

  // Steps of the world until the condition holds; at the pace of a simulation.
  bool run_until(const std::function<bool()>& condition, bool cut = false) {
    return test::wait_until(condition, [&] { step(cut); });
  }

  std::vector<BodyVersion> versions() const { return {test::version_of(world->mesh())}; }

  NetworkOptions network;
  std::uint64_t epoch = 1;
  std::unique_ptr<MovingWorld> world;
  std::unique_ptr<ServerNet> server;
};

TEST_F(Replication, D_1_two_viewers_follow_and_end_with_the_servers_hash) {
  open(own_session());
  Viewer a(network), b(network);
  ASSERT_TRUE(run_until([&] {
    a.look(), b.look();
    return a.frames > 0 && b.frames > 0;
  }));
  for (int i = 0; i < 500; ++i) {
    step(i % 3 == 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    a.look(), b.look();
  }
  EXPECT_TRUE(run_until([&] { return a.agrees_with(versions()) && b.agrees_with(versions()); }));
  EXPECT_GT(world->mesh().revision(), 150u);
  EXPECT_GT(a.frames, 20);
  EXPECT_EQ(a.net.counts().damaged, 0u);
  EXPECT_EQ(server->writes_refused(), 0u);
}

TEST_F(Replication, D_2_a_viewer_that_joins_in_mid_cut_ends_with_the_servers_hash) {
  open(own_session());
  for (int i = 0; i < 3000; ++i) step(i % 2 == 0);  // more deltas than a late joiner is given
  Viewer late(network);
  ASSERT_TRUE(run_until([&] { return late.agrees_with(versions()) && late.frames > 0; }, false));
  for (int i = 0; i < 100; ++i) {
    step(true);
    late.look();
  }
  EXPECT_TRUE(run_until([&] { return late.agrees_with(versions()); }));
  EXPECT_GT(late.frame.bodies.at(0).revision, 1000u);
}

TEST_F(Replication, D_2_a_viewer_that_joins_a_server_at_rest_sees_the_last_state) {
  open(own_session());
  for (int i = 0; i < 20; ++i) step(i % 2 == 0);
  const std::uint64_t last = world->steps();
  Viewer late(network);
  EXPECT_TRUE(test::wait_until([&] { return late.look(); }));
  EXPECT_LE(late.frame.step, last);
}

TEST_F(Replication, a_viewer_that_sleeps_through_a_thousand_deltas_is_resynced_and_holds_nobody_up) {
  open(own_session());
  Viewer awake(network), sleeper(network);
  ASSERT_TRUE(run_until([&] {
    awake.look(), sleeper.look();
    return awake.frames > 0 && sleeper.frames > 0;
  }));
  for (int i = 0; i < 1500; ++i) {
    step(true);
    awake.look();
    if (i % 20 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(run_until([&] { return awake.agrees_with(versions()); }));
  EXPECT_TRUE(run_until([&] { return sleeper.agrees_with(versions()); }));
  EXPECT_EQ(server->writes_refused(), 0u);
}

TEST_F(Replication, A_ARCH_7_each_side_keeps_exactly_the_objects_of_the_scene) {
  open(own_session());
  Viewer viewer(network);
  ASSERT_TRUE(run_until([&] {
    viewer.look();
    return viewer.frames > 0;
  }));
  EXPECT_EQ(viewer.replica.bodies().size(), 1u);
  EXPECT_EQ(viewer.frame.bodies.at(0).name, "liver");
  EXPECT_EQ(viewer.frame.tools.at(0).name, "scalpel");

  // The same session, begun anew by a server with two bodies: the old objects are gone.
  server.reset();
  SceneInfo scene = world->scene(network.session);
  scene.bodies.push_back({"kidney", Vec3(0.5, 0.1, 0.1), Vec3(0.6, 0.1, 0.1)});
  server = std::make_unique<ServerNet>(ServerNetOptions{network, 1000, first_epoch(++epoch)}, scene,
                                       std::vector{world->mesh(), world->mesh()});
  ASSERT_TRUE(test::wait_until([&] { return viewer.frame.bodies.size() == 2; },
                               [&] {
                                 StepOutput output = world->step(false);
                                 WorldView view = world->view();
                                 view.bodies.push_back(view.bodies[0]);
                                 server->publish(output, view, 0.001);
                                 viewer.look();
                               }));
  EXPECT_EQ(viewer.frame.bodies[1].name, "kidney");
  EXPECT_EQ(viewer.replica.bodies().size(), 2u);
}

TEST_F(Replication, sessions_of_one_domain_do_not_see_each_other) {
  open(own_session());
  NetworkOptions other = network;
  other.session += "-other";
  Viewer stranger(other), viewer(network);
  ASSERT_TRUE(run_until([&] {
    viewer.look(), stranger.look();
    return viewer.frames > 5;
  }));
  EXPECT_FALSE(stranger.replica.scene());
  EXPECT_EQ(stranger.net.counts().messages, 0u);
}

TEST_F(Replication, in_packets_for_real_networks_all_ends_the_same) {
  NetworkOptions options = own_session();
  options.peers = {"127.0.0.1"};
  options.interfaces = {"127.0.0.1"};
  options.insecure = true;
  open(options, 4);
  Viewer viewer(network);
  ASSERT_TRUE(run_until([&] {
    viewer.look();
    return viewer.frames > 0;
  }));
  for (int i = 0; i < 200; ++i) {
    step(true);
    viewer.look();
  }
  EXPECT_TRUE(run_until([&] { return viewer.agrees_with(versions()); }));
  EXPECT_EQ(server->writes_refused(), 0u);
}

TEST_F(Replication, the_end_names_final_versions_and_is_served_until_viewers_have_left) {
  open(own_session());
  auto viewer = std::make_unique<Viewer>(network);
  ASSERT_TRUE(run_until([&] {
    viewer->look();
    return viewer->frames > 0;
  }));
  for (int i = 0; i < 100; ++i) step(true);
  const SessionEnd end = server->end_session("duration");
  EXPECT_EQ(end.bodies.at(0), (BodyVersion{world->mesh().revision(), world->mesh().hash()}));
  EXPECT_FALSE(server->wait_for_viewers_to_leave(0));

  const auto knows_the_end = [&](Viewer& any) { return any.agrees_with(versions()) && any.replica.session_end(); };
  ASSERT_TRUE(test::wait_until([&] { return knows_the_end(*viewer); }));
  EXPECT_EQ(viewer->replica.session_end()->bodies, end.bodies);
  EXPECT_EQ(viewer->replica.catch_up(), end.bodies);
  // A viewer that comes after the end still gets it.
  Viewer late(network);
  EXPECT_TRUE(test::wait_until([&] { return knows_the_end(late); }));
  viewer.reset();
  EXPECT_FALSE(server->wait_for_viewers_to_leave(0));  // the late one is still there
}

TEST_F(Replication, poses_reach_the_server_once_and_in_order_and_models_come_back) {
  open(own_session());
  BridgeNet bridge(network, 0);
  std::vector<ToolSample> samples;
  ContactModel model;
  bool answered = false;
  std::uint64_t sequence = 0;
  StepOutput output;
  output.contacts.resize(1);
  const auto go_on = [&] {
    ++sequence;
    bridge.publish({sequence, static_cast<double>(sequence) * 0.001, {}});
    server->take_samples(samples);
    output.step = sequence;
    output.contacts[0].sequence = sequence;
    output.contacts[0].force_world_n = Vec3(0, 0, 2);
    server->publish(output, world->view(), 0.001);
    answered = bridge.latest_model(model) || answered;
  };
  test::wait_until([&] { return samples.size() >= 300 && answered; }, go_on);
  ASSERT_GE(samples.size(), 300u);
  EXPECT_TRUE(answered);
  EXPECT_EQ(model.force_world_n.z(), 2);
  for (std::size_t i = 1; i < samples.size(); ++i) ASSERT_EQ(samples[i].sequence, samples[i - 1].sequence + 1);
  EXPECT_EQ(bridge.samples_dropped(), 0u);
  EXPECT_EQ(bridge.servers(), 1u);
  server->end_session("test");
  EXPECT_TRUE(test::wait_until([&] { return bridge.session_ended(); }));
}

// The values that a viewer has are those that an engine published, to the nearest of 65536 levels.
TEST_F(Replication, numbers_for_each_vertex_reach_a_viewer_as_they_were_quantised) {
  open(own_session());
  Viewer viewer(network);
  std::vector<ScalarField> published;
  const auto publish = [&](bool cut) {
    const StepOutput output = world->step(cut);
    WorldView view = world->view();
    for (ScalarField& field : published) field.values.resize(world->mesh().vertex_slots(), 1.5f);
    view.scalars = [&](std::uint32_t) { return published; };
    server->publish(output, view, 0.001);
    viewer.look();
  };
  const auto agrees = [&] {
    if (viewer.frames == 0 || viewer.frame.bodies[0].scalars.size() != published.size()) return false;
    for (std::size_t i = 0; i < published.size(); ++i) {
      ScalarField expected = published[i];
      for (float& value : expected.values)
        value = from_level(to_level(value, expected.least, expected.most), expected.least, expected.most);
      if (!(viewer.frame.bodies[0].scalars[i] == expected)) return false;
    }
    return viewer.frame.bodies[0].revision == world->mesh().revision();
  };
  const auto publish_until_equal = [&] { return test::wait_until(agrees, [&] { publish(false); }); };
  EXPECT_TRUE(publish_until_equal()) << "without an engine that publishes there is no field";

  published = {{"wetness", 0, 1, {}}, {"temperature", 20, 90, {}}};
  for (VertexId v = 0; v < world->mesh().vertex_slots(); ++v) {
    published[0].values.push_back(static_cast<float>(v % 17) / 16);
    published[1].values.push_back(37 + 0.01f * static_cast<float>(v));
  }
  EXPECT_TRUE(publish_until_equal());

  for (int i = 0; i < 60; ++i) publish(true);  // new vertices, and slots that are used again
  for (VertexId v = 0; v < world->mesh().vertex_slots(); v += 3) published[1].values[v] = 85.25f;
  EXPECT_TRUE(publish_until_equal());
  EXPECT_EQ(viewer.frame.bodies[0].scalars[1].values.size(), world->mesh().vertex_slots());

  published.pop_back();
  EXPECT_TRUE(publish_until_equal()) << "a field that is no longer published is gone";
  EXPECT_EQ(viewer.net.counts().damaged, 0u);
  EXPECT_EQ(server->writes_refused(), 0u);
}

// From the scene file to the viewer: nothing between them knows these engines.
TEST(OwnEngines, a_scalar_that_an_engine_of_a_scene_publishes_reaches_a_viewer) {
  const EngineTable table = test::table_with_own_engines();
  const test::OwnEnginesScene file;
  const Scene scene = file.load(table);
  Simulation simulation(scene, table);
  SceneInfo info = scene_info(scene);
  const NetworkOptions network = own_session();
  info.session = network.session;
  ServerNet server({network, 1000, 7}, info, {simulation.mesh(0), simulation.mesh(1)});
  Viewer viewer(network);
  WorldView view;
  const auto value = [&](const char* name) {
    if (viewer.frame.bodies.size() < 2) return -1.0f;
    for (const ScalarField& field : viewer.frame.bodies[1].scalars)
      if (field.name == name && field.values.size() == simulation.mesh(1).vertex_slots()) return field.values[0];
    return -1.0f;
  };
  EXPECT_TRUE(test::wait_until([&] { return value("temperature") >= 1 && value("wetness") >= 1; },
                               [&] {
                                 const StepOutput& output = simulation.step({});
                                 view_world(simulation, scene.tools.size(), view);
                                 server.publish(output, view, 0.001);
                                 viewer.look();
                               }));
  EXPECT_NEAR(value("temperature"), 1, 0.3) << "2 K/s";
  EXPECT_NEAR(value("wetness"), 1, 0.6) << "2 ml/s, up to 1.5";
  EXPECT_EQ(viewer.net.counts().damaged, 0u);
}

TEST(Network, options_that_will_not_do_name_their_flag) {
  const auto message = [](const NetworkOptions& options) -> std::string {
    try {
      check_network_options(options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message({}), "");
  EXPECT_NE(message({233, "s", {}, {}}).find("--domain"), std::string::npos);
  EXPECT_NE(message({0, "a*", {}, {}}).find("--session"), std::string::npos);
  EXPECT_NE(message({0, std::string(65, 'a'), {}, {}}).find("--session"), std::string::npos);
  EXPECT_NE(message({0, "s", {}, {"203.0.113.7"}}).find("no interface of this machine"), std::string::npos);
  EXPECT_NE(message({0, "s", {"host"}, {}}).find("--peer"), std::string::npos);
  EXPECT_NE(message({0, "s", {}, {"1.2.3"}}).find("--interface"), std::string::npos);
}

}  // namespace
}  // namespace sectio
