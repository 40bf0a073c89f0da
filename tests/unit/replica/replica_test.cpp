#include "render_client/replica/replica.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "sim_server/net/state_encoder.h"
#include "tests/support/moving_world.h"
#include "tests/support/random.h"

namespace sectio::replica_test {
namespace {

using test::MovingWorld;

// A server and a replica with a wire of vectors in between, which a test can damage.
class Replicas : public testing::Test {
 protected:
  static constexpr std::uint64_t kEpoch = 7;
  static constexpr double kFrame_s = 1.0 / 60;

  Replicas() : encoder(kEpoch, MovingWorld::kStep_s, 1) {
    SceneInfo scene = world.scene("replica");
    scene.epoch = kEpoch;
    scene.bodies[0].regions = {Region{.name = "tumour", .parts = {RegionPart{}}}};
    replica.reset(scene);
  }

  struct Sent {
    std::vector<DeltaMessage> deltas;
    StateHeader header;
    std::vector<StatePiece> pieces;
  };

  Sent step(bool cut) {
    Sent sent;
    for (BodyDelta& delta : world.step(cut).deltas) {
      encoder.changed(0, delta.delta);
      sent.deltas.push_back({kEpoch, 0, std::move(delta.delta)});
    }
    StateSnapshot snapshot;
    snapshot.step = world.steps();
    snapshot.gravity_m_per_s2 = Vec3(1, 0, -9);
    snapshot.bodies = {{world.mesh().revision(), world.positions()}};
    snapshot.tools = {{true, world.view().tool_poses_world[0].value()}};
    encoder.encode(snapshot);
    sent.header = encoder.header();
    sent.pieces.assign(encoder.pieces().begin(), encoder.pieces().end());
    now_s += kFrame_s;
    return sent;
  }

  void deliver(const Sent& sent) {
    for (const DeltaMessage& delta : sent.deltas) replica.feed(delta);
    replica.feed(sent.header);
    for (const StatePiece& piece : sent.pieces) replica.feed(piece);
  }

  void deliver_keyframe() {
    replica.feed_keyframe(kEpoch, 0, to_bytes(keyframe_of(world.mesh())));
    encoder.refresh(0);
  }

  // Serves what the replica asks for, as a server would.
  void serve() {
    if (!replica.take_requests(now_s).empty()) deliver_keyframe();
  }

  // All that a frame promises: one step for every vertex, on that revision's topology.
  void expect_whole(const Frame& drawn) {
    ASSERT_EQ(drawn.bodies.size(), 1u);
    const BodyFrame& body = drawn.bodies[0];
    ASSERT_EQ(body.regions.size(), 1u);
    ASSERT_EQ(drawn.gravity_m_per_s2, Vec3(1, 0, -9));
    ASSERT_EQ(body.positions_world_m.size(), body.rest_body_m.size());
    std::vector<std::uint8_t> used(body.rest_body_m.size());
    for (const Triangle& triangle : body.triangles)
      if (triangle.alive())
        for (const VertexId v : triangle.v) used.at(v) = 1;
    for (std::size_t v = 0; v < used.size(); ++v) {
      if (!used[v]) continue;
      const double step = MovingWorld::step_of(body.positions_world_m[v], body.rest_body_m[v]);
      ASSERT_NEAR(step, static_cast<double>(drawn.step), 0.1) << "vertex " << v;
    }
  }

  MovingWorld world;
  StateEncoder encoder;
  Replica replica;
  Frame frame;
  double now_s = 0;
};

TEST_F(Replicas, before_the_topology_is_known_nothing_is_drawn_and_a_keyframe_is_requested) {
  deliver(step(false));
  EXPECT_FALSE(replica.frame(now_s, frame));
  ASSERT_EQ(replica.take_requests(now_s).size(), 1u);
  EXPECT_TRUE(replica.take_requests(now_s).empty());  // not again at once
}

TEST_F(Replicas, A_ARCH_2_a_frame_carries_exactly_one_step) {
  deliver_keyframe();
  int frames = 0;
  for (int i = 0; i < 200; ++i) {
    deliver(step(i % 3 == 0));
    if (!replica.frame(now_s, frame)) continue;
    ++frames;
    EXPECT_EQ(frame.step, world.steps());
    EXPECT_DOUBLE_EQ(frame.tools.at(0).pose_world.position_m.z(), static_cast<double>(frame.step) * 1e-4);
    expect_whole(frame);
  }
  EXPECT_EQ(frames, 200);
  EXPECT_EQ(replica.bodies()[0].mesh().hash(), world.mesh().hash());
}

TEST_F(Replicas, A_ARCH_2_pieces_of_the_next_step_do_not_tear_this_one) {
  deliver_keyframe();
  const Sent first = step(false);
  Sent second = step(false);
  deliver(first);
  for (const StatePiece& piece : second.pieces) replica.feed(piece);  // the header is late
  ASSERT_TRUE(replica.frame(now_s, frame));
  EXPECT_EQ(frame.step, first.header.step);
  expect_whole(frame);
  replica.feed(second.header);
  ASSERT_TRUE(replica.frame(now_s, frame));
  EXPECT_EQ(frame.step, second.header.step);
  expect_whole(frame);
}

TEST_F(Replicas, a_state_waits_for_its_delta) {
  deliver_keyframe();
  deliver(step(false));
  ASSERT_TRUE(replica.frame(now_s, frame));
  Sent cut = step(true);
  const std::vector<DeltaMessage> late = std::move(cut.deltas);
  cut.deltas.clear();
  deliver(cut);
  EXPECT_FALSE(replica.frame(now_s, frame));
  now_s += 1;
  EXPECT_FALSE(replica.frame(now_s, frame));  // not even patched
  replica.feed(late[0]);
  ASSERT_TRUE(replica.frame(now_s, frame));
  EXPECT_EQ(frame.bodies[0].revision, 1u);
  expect_whole(frame);
}

TEST_F(Replicas, a_delta_waits_for_its_state) {
  deliver_keyframe();
  const Sent before = step(false);
  const Sent cut = step(true);
  replica.feed(cut.deltas[0]);
  deliver(before);
  ASSERT_TRUE(replica.frame(now_s, frame));
  EXPECT_EQ(frame.bodies[0].revision, 0u);
  expect_whole(frame);
}

TEST_F(Replicas, a_vertex_in_a_reused_slot_is_not_drawn_at_the_old_position) {
  deliver_keyframe();
  deliver(step(false));
  ASSERT_TRUE(replica.frame(now_s, frame));
  Sent cut = step(true);
  const VertexId reborn = cut.deltas[0].delta.vertices[0].id;
  std::erase_if(cut.pieces, [&](const StatePiece& p) { return p.piece == reborn / kVerticesPerPiece; });
  deliver(cut);
  now_s += 1;
  EXPECT_FALSE(replica.frame(now_s, frame));  // patience is over, but there is no position of its own life
  deliver(step(false));
  ASSERT_TRUE(replica.frame(now_s, frame));
  expect_whole(frame);
}

TEST_F(Replicas, a_frame_waits_for_lost_pieces_and_is_then_patched) {
  deliver_keyframe();
  deliver(step(false));
  ASSERT_TRUE(replica.frame(now_s, frame));
  const std::uint64_t drawn = frame.step;
  Sent sent = step(false);
  sent.pieces.pop_back();
  deliver(sent);
  EXPECT_FALSE(replica.frame(now_s, frame));
  EXPECT_EQ(frame.step, drawn);
  now_s += 0.9 * Replica::kPatience_s;
  EXPECT_FALSE(replica.frame(now_s, frame));
  now_s += 0.2 * Replica::kPatience_s;
  ASSERT_TRUE(replica.frame(now_s, frame));
  EXPECT_EQ(frame.step, sent.header.step);
  EXPECT_EQ(replica.counts().patched_frames, 1u);
}

TEST_F(Replicas, D_1_any_loss_of_deltas_ends_with_the_servers_hash) {
  deliver_keyframe();
  test::Random random(99);
  int frames = 0;
  for (int i = 0; i < 1000; ++i) {
    Sent sent = step(i % 2 == 0);
    if (random() % 10 == 0) sent.deltas.clear();
    deliver(sent);
    serve();
    if (replica.frame(now_s, frame)) {
      ++frames;
      ASSERT_NO_FATAL_FAILURE(expect_whole(frame));
    }
  }
  for (int i = 0; i < 600; ++i) {  // ten quiet seconds
    deliver(step(false));
    serve();
    frames += replica.frame(now_s, frame);
  }
  EXPECT_EQ(replica.bodies()[0].mesh().hash(), world.mesh().hash());
  EXPECT_EQ(frame.step, world.steps());
  EXPECT_GT(replica.counts().resyncs, 5u);
  EXPECT_GT(frames, 700);
  EXPECT_LT(replica.counts().requests, 100u);
}

TEST_F(Replicas, lossy_states_are_drawn_ten_times_a_second_at_least_and_heal) {
  deliver_keyframe();
  test::Random random(4);
  double last_s = 0, longest_s = 0;
  for (int i = 0; i < 600; ++i) {
    Sent sent = step(i % 20 == 0);
    std::erase_if(sent.pieces, [&](const StatePiece&) { return random() % 10 == 0; });
    if (random() % 10 == 0) sent.header.epoch = 0;
    deliver(sent);
    serve();
    if (!replica.frame(now_s, frame)) continue;
    if (last_s > 0) longest_s = std::max(longest_s, now_s - last_s);
    last_s = now_s;
  }
  EXPECT_LT(longest_s, 0.25);
}

// Every message on its own: one in twenty is lost, the others take up to 50 ms, so that they overtake each other.
TEST_F(Replicas, D_4_loss_and_jitter_end_with_the_servers_hash) {
  test::Random random(20240904);
  std::multimap<double, std::function<void()>> wire;
  const auto send = [&](std::function<void()> arrive) {
    if (random() % 20 != 0) wire.emplace(now_s + 0.05 * static_cast<double>(random() % 1000) / 1000, std::move(arrive));
  };
  const auto run = [&](int steps, bool cut) {
    for (int i = 0; i < steps; ++i) {
      Sent sent = step(cut && i % 3 == 0);
      for (DeltaMessage& d : sent.deltas) send([this, d] { replica.feed(d); });
      send([this, header = sent.header] { replica.feed(header); });
      for (StatePiece& p : sent.pieces) send([this, p] { replica.feed(p); });
      if (!replica.take_requests(now_s).empty()) {
        send([this, bytes = to_bytes(keyframe_of(world.mesh()))] { replica.feed_keyframe(kEpoch, 0, bytes); });
        encoder.refresh(0);
      }
      for (; !wire.empty() && wire.begin()->first <= now_s; wire.erase(wire.begin())) wire.begin()->second();
      replica.frame(now_s, frame);
    }
  };
  run(1500, true);
  EXPECT_GT(frame.step, 1400u);
  run(600, false);
  replica.catch_up();
  EXPECT_EQ(replica.bodies()[0].mesh().hash(), world.mesh().hash());
  EXPECT_EQ(replica.counts().hash_mismatches, 0u);
  EXPECT_GT(frame.step, world.steps() - 30);
}

TEST_F(Replicas, D_1_a_hash_mismatch_asks_for_a_keyframe_and_leaves_the_mesh) {
  deliver_keyframe();
  deliver(step(false));
  ASSERT_TRUE(replica.frame(now_s, frame));
  const std::uint64_t hash = replica.bodies()[0].mesh().hash();
  Sent cut = step(true);
  cut.deltas[0].delta.hash_after ^= 1;
  deliver(cut);
  EXPECT_FALSE(replica.frame(now_s, frame));
  EXPECT_EQ(replica.counts().hash_mismatches, 1u);
  EXPECT_EQ(replica.bodies()[0].mesh().hash(), hash);
  EXPECT_TRUE(replica.take_requests(now_s).empty());  // a late delta gets its time
  now_s += 2 * Replica::kPatience_s;
  ASSERT_EQ(replica.take_requests(now_s).size(), 1u);
  deliver_keyframe();
  deliver(step(false));
  ASSERT_TRUE(replica.frame(now_s, frame));
  expect_whole(frame);
  EXPECT_EQ(replica.bodies()[0].mesh().hash(), world.mesh().hash());
}

TEST_F(Replicas, D_2_a_late_joiner_is_given_deltas_before_its_keyframe) {
  for (int i = 0; i < 50; ++i) step(true);
  const std::vector<std::uint8_t> keyframe = to_bytes(keyframe_of(world.mesh()));
  for (int i = 0; i < 10; ++i) deliver(step(true));
  replica.feed_keyframe(kEpoch, 0, keyframe);
  encoder.refresh(0);
  deliver(step(false));
  ASSERT_TRUE(replica.frame(now_s, frame));
  expect_whole(frame);
  EXPECT_EQ(replica.bodies()[0].mesh().hash(), world.mesh().hash());
  EXPECT_EQ(replica.counts().resyncs, 0u);
}

TEST_F(Replicas, requests_become_rare_when_nobody_answers) {
  int requests = 0;
  for (now_s = 0; now_s < 60; now_s += 0.01) requests += static_cast<int>(replica.take_requests(now_s).size());
  EXPECT_GE(requests, 10);
  EXPECT_LE(requests, 25);
}

TEST_F(Replicas, a_restarted_server_begins_anew_and_late_messages_of_the_old_one_are_ignored) {
  deliver_keyframe();
  deliver(step(false));
  ASSERT_TRUE(replica.frame(now_s, frame));
  const Sent ghost = step(false);
  SceneInfo scene = *replica.scene();
  scene.epoch = kEpoch + 1;
  replica.reset(scene);
  deliver(ghost);
  deliver_keyframe();
  EXPECT_FALSE(replica.frame(now_s + 1, frame));
  EXPECT_FALSE(replica.bodies()[0].known());
}

TEST_F(Replicas, topology_is_copied_only_when_it_changed) {
  deliver_keyframe();
  deliver(step(false));
  ASSERT_TRUE(replica.frame(now_s, frame));
  frame.bodies[0].triangles[0].surface = Surface::wall;  // a mark
  deliver(step(false));
  ASSERT_TRUE(replica.frame(now_s, frame));
  EXPECT_EQ(frame.bodies[0].triangles[0].surface, Surface::wall);
}

TEST_F(Replicas, the_end_of_a_session_is_reached_without_drawing) {
  deliver_keyframe();
  for (int i = 0; i < 5; ++i) {
    const Sent sent = step(true);
    for (const DeltaMessage& delta : sent.deltas) replica.feed(delta);
  }
  const std::vector<BodyVersion> versions = replica.catch_up();
  ASSERT_EQ(versions.size(), 1u);
  EXPECT_EQ(versions[0], (BodyVersion{world.mesh().revision(), world.mesh().hash()}));
  SessionEnd end{kEpoch, 99, "", {{world.mesh().revision() + 3, 0}}};
  replica.feed(end);
  replica.take_requests(now_s);
  EXPECT_EQ(replica.take_requests(now_s + 1).size(), 1u);  // more is wanted than came
}

TEST_F(Replicas, a_keyframe_replaces_a_lost_last_state_after_the_end) {
  deliver_keyframe();
  deliver(step(false));
  ASSERT_TRUE(replica.frame(now_s, frame));
  const Sent last = step(true);
  for (const DeltaMessage& delta : last.deltas) replica.feed(delta);
  const SessionEnd end{kEpoch, world.steps(), "", {{world.mesh().revision(), world.mesh().hash()}}};
  replica.feed(end);
  EXPECT_TRUE(replica.take_requests(now_s).empty());
  EXPECT_EQ(replica.take_requests(now_s + 1).size(), 1u);
  deliver(last);
  ASSERT_TRUE(replica.frame(now_s, frame));
  EXPECT_TRUE(replica.take_requests(now_s + 10).empty());
}

}  // namespace
}  // namespace sectio::replica_test
