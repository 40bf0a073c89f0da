// The bodies of one scene divided over several servers: viewers and hands see one world.
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <thread>

#include "common/messages/epoch.h"
#include "device_bridge/net/strongest_contact.h"
#include "sim_server/net/server_net.h"
#include "tests/support/dds_session.h"
#include "tests/support/moving_world.h"
#include "tests/support/patience.h"
#include "tests/support/replica_viewer.h"

namespace sectio::test {
namespace {

// One server of several, with one body.
struct Share {
  Share(const NetworkOptions& network, std::uint64_t begun, const std::string& body, int levels)
      : world(levels, static_cast<unsigned>(begun)) {
    SceneInfo scene = world.scene(network.session);
    scene.world_bodies = {"liver", "kidney"};
    scene.bodies[0].name = body;
    net = std::make_unique<ServerNet>(ServerNetOptions{network, 1000, first_epoch(begun)}, scene,
                                      std::vector{world.mesh()});
  }
  void step(bool cut) {
    const StepOutput output = world.step(cut);
    net->publish(output, world.view(), 0.001);
  }
  BodyVersion version() const { return version_of(world.mesh()); }

  MovingWorld world;
  std::unique_ptr<ServerNet> net;
};

class Shares : public testing::Test {
 protected:
  bool run_until(const std::function<bool()>& condition, bool cut = false) {
    return wait_until(condition, [&] {
      for (Share* share : {liver.get(), kidney.get()})
        if (share) share->step(cut);
    });
  }
  std::vector<BodyVersion> versions() const { return {liver->version(), kidney->version()}; }

  NetworkOptions network = own_session();
  std::unique_ptr<Share> kidney = std::make_unique<Share>(network, 1, "kidney", 2);
  std::unique_ptr<Share> liver = std::make_unique<Share>(network, 2, "liver", 3);
};

// A server that goes on with a session (--resume) waits for servers that it hasn't heard, and for no standby.
TEST_F(Shares, a_standby_that_waits_for_a_server_is_no_server_that_has_not_been_heard) {
  kidney.reset();
  MovingWorld world(2, 3);
  SceneInfo scene = world.scene("elsewhere");
  scene.bodies[0].name = "kidney";
  ServerNetOptions options{network, 1000};
  options.standby = true;
  ServerNet standby(options, scene, {world.mesh()});
  EXPECT_TRUE(wait_until([&] { return liver->net->servers_known() == 1 && liver->net->others().standbys() == 1; },
                         [&] { standby.follower().listen(std::nullopt); }));
  EXPECT_EQ(liver->net->others().count(), 0u);
}

TEST_F(Shares, A_ARCH_11_a_viewer_sees_one_world_of_two_servers_in_the_order_of_the_scene) {
  ReplicaViewer viewer(network);
  ASSERT_TRUE(run_until(
      [&] {
        viewer.look();
        return viewer.frames > 5;
      },
      true));
  EXPECT_EQ(viewer.replica.servers(), 2u);
  EXPECT_EQ(viewer.replica.body_names(), (std::vector<std::string>{"liver", "kidney"}));
  ASSERT_EQ(viewer.frame.bodies.size(), 2u) << "no picture before all are there";
  EXPECT_EQ(viewer.frame.bodies[0].name, "liver");
  EXPECT_GT(viewer.frame.bodies[0].positions_world_m.size(), viewer.frame.bodies[1].positions_world_m.size());
  EXPECT_TRUE(run_until([&] {
    viewer.look();
    return viewer.replica.catch_up() == versions();
  }));

  // One who comes late gets the same; so does one who comes after the end.
  ReplicaViewer late(network);
  EXPECT_TRUE(run_until([&] {
    late.look();
    return late.frames > 0 && late.replica.catch_up() == versions();
  }));
  liver->net->end_session("complete");
  EXPECT_FALSE(viewer.replica.session_end()) << "the other one goes on";
  kidney->net->end_session("complete");
  EXPECT_TRUE(run_until([&] {
    late.look();
    return late.replica.session_end().has_value();
  }));
  EXPECT_EQ(late.replica.session_end()->bodies, versions());
  EXPECT_EQ(viewer.net.counts().damaged, 0u);
}

TEST_F(Shares, A_ARCH_11_a_server_that_is_started_again_takes_its_own_place_only) {
  ReplicaViewer viewer(network);
  ASSERT_TRUE(run_until(
      [&] {
        viewer.look();
        return viewer.frames > 0;
      },
      true));
  kidney.reset();
  kidney = std::make_unique<Share>(network, 3, "kidney", 1);
  EXPECT_TRUE(run_until([&] {
    viewer.look();
    return viewer.frame.bodies.at(1).triangles.size() == kidney->world.mesh().triangle_slots();
  }));
  EXPECT_TRUE(run_until([&] {
    viewer.look();
    return viewer.replica.catch_up() == versions();
  }));
  EXPECT_EQ(viewer.replica.servers(), 2u);
  EXPECT_EQ(viewer.replica.body_names(), (std::vector<std::string>{"liver", "kidney"}));
}

TEST_F(Shares, servers_know_who_is_missing_and_the_later_one_of_two_with_a_body_gives_way) {
  EXPECT_TRUE(run_until(
      [&] { return kidney->net->others().missing_bodies().empty() && liver->net->others().missing_bodies().empty(); }));
  EXPECT_FALSE(kidney->net->others().claimed_body());
  ReplicaViewer viewer(network);
  ASSERT_TRUE(run_until([&] {
    viewer.look();
    return viewer.frames > 0;
  }));
  Share second(network, 9, "liver", 1);
  EXPECT_TRUE(run_until([&] {
    viewer.look();
    return second.net->others().claimed_body() == "liver";
  }));
  EXPECT_FALSE(liver->net->others().claimed_body());
  // Nor does one whose clock is behind disturb the one that has begun.
  Share behind(network, 0, "liver", 1);
  EXPECT_TRUE(run_until([&] { return behind.net->others().claimed_body() == "liver"; }));
  EXPECT_FALSE(liver->net->others().claimed_body());
  // It was never seen: it has not begun.
  const int before = viewer.frames;
  EXPECT_TRUE(run_until([&] {
    viewer.look();
    return viewer.frames > before + 20;
  }));
  EXPECT_EQ(viewer.replica.catch_up().at(0).topology_hash, liver->version().topology_hash);
}

ContactMessage touched(std::uint64_t begun, std::uint64_t sequence, ContactState state, double force_n) {
  ContactMessage message{first_epoch(begun), {}};
  message.model.sequence = sequence;
  message.model.state = state;
  message.model.force_world_n = Vec3(0, 0, force_n);
  return message;
}

TEST(StrongestContact, the_hand_feels_what_it_is_deepest_in) {
  StrongestContact felt;
  EXPECT_TRUE(felt.feel(1, touched(5, 1, ContactState::free, 0)));
  EXPECT_TRUE(felt.feel(1, touched(8, 1, ContactState::contact, 2)));
  EXPECT_FALSE(felt.feel(1.001, touched(5, 2, ContactState::free, 0)));
  EXPECT_FALSE(felt.feel(1.001, touched(5, 3, ContactState::contact, 1)));
  EXPECT_TRUE(felt.feel(1.002, touched(5, 4, ContactState::contact, 3)));
  EXPECT_EQ(felt.model().force_world_n.z(), 3);
  EXPECT_FALSE(felt.feel(1.002, touched(5, 4, ContactState::penetration, 9))) << "seen already";
  EXPECT_TRUE(felt.feel(1.003, touched(8, 2, ContactState::penetration, 0.5)));
  // A server that has died says nothing any more, and is not felt either.
  EXPECT_TRUE(felt.feel(1.003 + 2 * StrongestContact::kSilence_s, touched(5, 5, ContactState::free, 0)));
}

TEST(StrongestContact, a_server_that_takes_a_session_over_is_felt_at_once_and_the_one_before_it_no_more) {
  StrongestContact felt;
  ContactMessage before = touched(5, 7, ContactState::penetration, 3), after = touched(5, 6, ContactState::contact, 2);
  ++after.epoch;
  EXPECT_TRUE(felt.feel(1, before));
  EXPECT_TRUE(felt.feel(1.15, after)) << "though it counts from where it stands";
  EXPECT_EQ(felt.model().force_world_n.z(), 2);
  before.model.sequence = 9;
  EXPECT_FALSE(felt.feel(1.151, before)) << "it woke up";
  felt.end(1.2, before.epoch);
  EXPECT_FALSE(felt.all_ended(1.2)) << "a ghost can't end a session";
  felt.end(1.2, after.epoch);
  EXPECT_TRUE(felt.all_ended(1.2));
}

TEST(StrongestContact, the_session_is_over_when_nobody_speaks_any_more) {
  StrongestContact felt;
  EXPECT_FALSE(felt.all_ended(0.5));
  felt.feel(1, touched(5, 1, ContactState::free, 0));
  felt.feel(1, touched(8, 1, ContactState::free, 0));
  felt.end(1.1, first_epoch(5));
  EXPECT_FALSE(felt.all_ended(1.1));
  felt.end(1.1, first_epoch(8));
  EXPECT_TRUE(felt.all_ended(1.1));
}

}  // namespace
}  // namespace sectio::test
