#include "render_client/replica/world.h"

#include <gtest/gtest.h>

#include "common/delta/keyframe.h"
#include "common/messages/epoch.h"
#include "sim_server/net/state_encoder.h"
#include "tests/support/moving_world.h"

namespace sectio::test {
namespace {

// A server with one of two bodies, and a wire that loses nothing.
struct Share {
  Share(std::uint64_t session, const std::string& body)
      : epoch(first_epoch(session)), encoder(epoch, MovingWorld::kStep_s, 1) {
    scene = source.scene("theatre");
    scene.epoch = epoch;
    scene.world_bodies = {"liver", "kidney"};
    scene.bodies[0].name = body;
  }
  void send_step(World& world) {
    for (const BodyDelta& delta : source.step(false).deltas) world.feed(DeltaMessage{epoch, 0, delta.delta});
    StateSnapshot snapshot;
    snapshot.step = source.steps();
    snapshot.bodies = {{source.mesh().revision(), source.positions()}};
    snapshot.tools.resize(1);
    encoder.encode(snapshot);
    world.feed(encoder.header());
    for (const StatePiece& piece : encoder.pieces()) world.feed(piece);
  }
  void send_keyframe(World& world) {
    for (KeyframeChunk& chunk :
         split_keyframe(epoch, 0, source.mesh().revision(), to_bytes(keyframe_of(source.mesh())), kChunkBytes))
      world.feed(std::move(chunk));
    encoder.refresh(0);
  }
  void appear(World& world) {
    world.announce(scene);
    send_keyframe(world);
    send_step(world);
  }
  void become(std::uint64_t other_epoch) {
    epoch = scene.epoch = other_epoch;
    encoder = StateEncoder(epoch, MovingWorld::kStep_s, 1);
    encoder.refresh(0);
  }
  SessionEnd end() const {
    return {epoch, source.steps(), "complete", {{source.mesh().revision(), source.mesh().hash()}}};
  }

  std::uint64_t epoch;
  MovingWorld source;
  StateEncoder encoder;
  SceneInfo scene;
};

// One server, which is drawn, and a later term of its session.
struct OneServer {
  OneServer() {
    kidney.scene.world_bodies = {"kidney"};
    kidney.appear(world);
    EXPECT_TRUE(world.frame(0, frame));
  }
  void claim() {
    kidney.become(later);
    world.announce(kidney.scene);
    kidney.send_step(world);
    EXPECT_TRUE(world.frame(0.01, frame)) << "without a keyframe";
  }
  void say_a_word_of_the_first() {
    kidney.become(first);
    kidney.send_step(world);
    EXPECT_FALSE(world.frame(0.02, frame)) << "a ghost";
  }

  World world;
  Frame frame;
  Share kidney{1, "kidney"};
  const std::uint64_t first = kidney.epoch, later = first + 3;
};

TEST(World, the_first_picture_waits_for_all_bodies_for_a_bounded_time) {
  World world;
  Frame frame;
  Share kidney(1, "kidney"), liver(2, "liver");
  kidney.appear(world);
  EXPECT_FALSE(world.frame(0, frame));
  liver.appear(world);
  ASSERT_TRUE(world.frame(0.1, frame));
  ASSERT_EQ(frame.bodies.size(), 2u);
  EXPECT_EQ(frame.bodies[0].name, "liver");

  World half;
  Share alone(3, "kidney");
  alone.appear(half);
  EXPECT_FALSE(half.frame(0, frame));
  EXPECT_TRUE(half.frame(World::kGather_s + 0.1, frame));
  EXPECT_EQ(frame.bodies.size(), 1u);
}

// A server was halted, while another took its session over and fell silent in its turn.
TEST(World, a_later_term_goes_on_with_the_bodies_at_once_and_gives_way_when_it_says_nothing) {
  OneServer session;
  auto& [world, frame, kidney, first, later] = session;
  const std::size_t requests = world.take_requests(0).size();

  session.claim();
  EXPECT_EQ(frame.step, kidney.source.steps());
  EXPECT_EQ(world.take_requests(0.01).size(), requests);
  session.say_a_word_of_the_first();
  world.announce(kidney.scene);
  EXPECT_FALSE(world.frame(0.03, frame)) << "it can announce itself as often as it likes";

  kidney.send_step(world);
  world.frame(0.02 + 2 * World::kSilence_s, frame);
  kidney.send_keyframe(world);
  kidney.send_step(world);
  ASSERT_TRUE(world.frame(0.03 + 2 * World::kSilence_s, frame)) << "nobody else speaks";
  EXPECT_EQ(frame.step, kidney.source.steps());
  EXPECT_EQ(world.servers(), 1u);
}

// The halted server woke, said a word and stood down. Its successor is busy for a while before it ends the session.
TEST(World, a_later_term_keeps_its_place_through_a_silence_in_which_nobody_speaks) {
  OneServer session;
  auto& [world, frame, kidney, first, later] = session;
  session.claim();
  session.say_a_word_of_the_first();

  EXPECT_FALSE(world.frame(0.03 + 2 * World::kSilence_s, frame));
  kidney.become(later);
  world.feed(kidney.end());
  EXPECT_TRUE(world.session_end());
}

// The server begins its session anew: steps and revisions go back to where they began.
TEST(World, a_later_term_that_goes_far_back_is_drawn_from_its_own_keyframes) {
  World world;
  Frame frame;
  Share kidney(1, "kidney");
  kidney.scene.world_bodies = {"kidney"};
  const MovingWorld fresh = kidney.source;
  while (static_cast<double>(kidney.source.steps()) * MovingWorld::kStep_s < 2 * Replica::kMostLost_s)
    kidney.source.step(true);
  kidney.appear(world);
  ASSERT_TRUE(world.frame(0, frame));
  const std::uint64_t before = frame.step;

  kidney.source = fresh;
  kidney.become(kidney.epoch + 1);
  world.announce(kidney.scene);
  kidney.send_step(world);
  EXPECT_FALSE(world.frame(0.01, frame));
  EXPECT_FALSE(world.take_requests(0.01).empty());
  kidney.send_keyframe(world);
  kidney.send_step(world);
  ASSERT_TRUE(world.frame(0.02, frame));
  EXPECT_LT(frame.step, before);
  EXPECT_EQ(frame.bodies[0].revision, kidney.source.mesh().revision());
}

TEST(World, a_server_takes_the_place_of_one_that_has_fallen_silent_when_it_can_be_drawn) {
  World world;
  Frame frame;
  Share kidney(1, "kidney"), liver(2, "liver"), newer(5, "kidney");
  kidney.appear(world);
  liver.appear(world);
  ASSERT_TRUE(world.frame(0, frame));
  world.announce(newer.scene);
  EXPECT_FALSE(world.frame(1, frame)) << "the old one stays on the screen";
  EXPECT_FALSE(world.take_requests(1).empty()) << "and the new one is asked for";
  for (int i = 0; i < 7; ++i) newer.source.step(true);
  newer.send_keyframe(world);
  newer.send_step(world);
  const std::uint64_t arrangement = frame.arrangement;
  ASSERT_TRUE(world.frame(1.1, frame));
  EXPECT_NE(frame.arrangement, arrangement);
  EXPECT_EQ(world.servers(), 2u);
  ASSERT_EQ(frame.bodies.size(), 2u);
  EXPECT_EQ(frame.bodies[1].revision, newer.source.mesh().revision());
  EXPECT_FALSE(world.frame(9, frame)) << "nobody comes back without a word";
}

TEST(World, a_server_that_sends_states_keeps_its_place) {
  World world;
  Frame frame;
  Share kidney(1, "kidney"), liver(2, "liver"), intruder(5, "kidney");
  for (int i = 0; i < 7; ++i) intruder.source.step(true);
  kidney.appear(world);
  liver.appear(world);
  intruder.appear(world);
  for (double now_s = 0; now_s < 2; now_s += 0.1) {
    kidney.send_step(world);
    if (now_s < 1) intruder.send_step(world);
    ASSERT_TRUE(world.frame(now_s, frame));
    EXPECT_EQ(frame.bodies[1].revision, kidney.source.mesh().revision());
  }
  world.feed(kidney.end());
  world.feed(liver.end());
  world.frame(2.1, frame);
  ASSERT_TRUE(world.session_end()) << "the intruder, silent itself, has not taken the place of one that ended";
}

TEST(World, time_and_instruments_are_those_of_a_server_that_speaks) {
  World world;
  Frame frame;
  Share kidney(1, "kidney"), liver(2, "liver");
  kidney.appear(world);
  for (int i = 0; i < 50; ++i) liver.source.step(false);
  liver.appear(world);
  ASSERT_TRUE(world.frame(0, frame));
  EXPECT_EQ(frame.step, liver.source.steps());
  kidney.send_step(world);
  ASSERT_TRUE(world.frame(World::kGone_s + 0.1, frame));
  EXPECT_EQ(frame.step, kidney.source.steps()) << "the other one is dead";
  ASSERT_EQ(frame.bodies.size(), 2u);
}

TEST(World, is_left_by_a_server_that_has_died_when_the_others_have_ended) {
  World world;
  Frame frame;
  Share kidney(1, "kidney"), liver(2, "liver");
  kidney.appear(world);
  liver.appear(world);
  ASSERT_TRUE(world.frame(0, frame));
  EXPECT_EQ(world.left_by(100), "") << "both may come back";
  world.feed(liver.end());
  EXPECT_EQ(world.left_by(World::kGone_s - 0.1), "");
  ServerStatus paused;
  paused.epoch = kidney.epoch;
  world.feed(paused);
  world.frame(5, frame);
  EXPECT_EQ(world.left_by(World::kGone_s + 0.1), "") << "it sends no states in a pause";
  EXPECT_EQ(world.left_by(World::kGone_s + 5.1), "kidney");
  EXPECT_FALSE(world.session_end());
  world.feed(kidney.end());
  EXPECT_EQ(world.left_by(100), "");
  EXPECT_TRUE(world.session_end());
}

TEST(World, an_intruder_that_was_seen_first_leaves_its_place_when_it_falls_silent) {
  World world;
  Frame frame;
  Share intruder(5, "kidney"), kidney(1, "kidney"), liver(2, "liver");
  for (int i = 0; i < 7; ++i) intruder.source.step(true);
  intruder.appear(world);
  liver.appear(world);
  kidney.appear(world);
  ASSERT_TRUE(world.frame(0, frame));
  EXPECT_EQ(frame.bodies[1].revision, intruder.source.mesh().revision());
  for (double now_s = 0.1; now_s < 2; now_s += 0.1) {
    kidney.send_step(world);
    world.frame(now_s, frame);
  }
  EXPECT_EQ(frame.bodies[1].revision, kidney.source.mesh().revision());
  world.feed(kidney.end());
  world.feed(liver.end());
  EXPECT_TRUE(world.session_end());
}

TEST(World, an_end_counts_even_before_its_server_is_announced) {
  World world;
  Frame frame;
  Share kidney(1, "kidney"), liver(2, "liver");
  kidney.appear(world);
  world.feed(kidney.end());
  EXPECT_TRUE(world.session_end()) << "of all that are known";
  world.feed(liver.end());
  liver.appear(world);
  ASSERT_TRUE(world.frame(0, frame));
  ASSERT_TRUE(world.session_end());
  EXPECT_EQ(world.session_end()->bodies, world.catch_up());
  EXPECT_GT(world.bytes(), 0u);
}

TEST(World, endless_announcements_take_bounded_memory) {
  World world;
  Frame frame;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    Share share(i + 1, "body" + std::to_string(i));
    world.announce(share.scene);
    world.feed(SessionEnd{5000 + i, 1, "complete", {}});
  }
  EXPECT_EQ(world.servers(), World::kMaxServers);
  EXPECT_FALSE(world.frame(0, frame));
}

}  // namespace
}  // namespace sectio::test
