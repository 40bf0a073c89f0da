// The gateway's copy of a session, when another server takes the session over.
#include "render_client/gateway/session_copy.h"

#include <gtest/gtest.h>

#include "common/delta/keyframe.h"
#include "common/messages/codec.h"
#include "common/messages/epoch.h"
#include "tests/support/moving_world.h"

namespace sectio::test {
namespace {

struct CopyOfAWorld : testing::Test {
  MovingWorld world;
  SceneInfo scene = world.scene("theatre");
  SessionCopy copy;

  void SetUp() override {
    scene.epoch = first_epoch(5);
    copy.announce(scene);
  }
  void send_keyframe() {
    for (KeyframeChunk& chunk :
         split_keyframe(scene.epoch, 0, world.mesh().revision(), to_bytes(keyframe_of(world.mesh())), kChunkBytes))
      copy.feed(std::move(chunk));
  }
  StateHeader state() const {
    StateHeader header;
    header.epoch = scene.epoch;
    header.bodies = {BodyState{}};
    header.bodies[0].revision = world.mesh().revision();
    return header;
  }
};

TEST_F(CopyOfAWorld, goes_on_with_the_bodies_of_a_later_term_and_hears_no_ghost) {
  const auto send_cuts = [&](std::uint64_t epoch) {
    for (const BodyDelta& delta : world.step(true).deltas) copy.feed(DeltaMessage{epoch, 0, delta.delta});
  };
  const auto revision_served = [&](std::uint64_t epoch) {
    const auto& chunks = copy.keyframe({epoch, 0, kNoRevision, 0});
    return chunks.empty() ? std::nullopt : std::optional(decode<KeyframeChunk>(*chunks.front()));
  };
  send_keyframe();
  send_cuts(scene.epoch);
  ASSERT_TRUE(revision_served(scene.epoch));

  const std::uint64_t before = scene.epoch;
  scene.epoch += 2;
  copy.announce(scene);
  EXPECT_FALSE(copy.knows(before));
  send_cuts(scene.epoch);
  const auto served = revision_served(scene.epoch);
  ASSERT_TRUE(served) << "without a keyframe of the new server";
  EXPECT_EQ(served->epoch, scene.epoch);
  EXPECT_EQ(served->revision, world.mesh().revision());
  scene.epoch = before;
  copy.announce(scene);
  EXPECT_FALSE(copy.knows(before)) << "a ghost";
  EXPECT_EQ(copy.scenes().size(), 1u);
}

// A server may have died without a word, and another one have come with another scene: who joins sees the living one.
TEST_F(CopyOfAWorld, names_the_server_first_that_was_heard_last) {
  for (const std::uint64_t name : {5, 6}) {
    scene.epoch = first_epoch(name);
    copy.announce(scene);
    copy.feed(state());
    const auto first = decode<SceneInfo>(*copy.scenes().front());
    ASSERT_TRUE(first);
    EXPECT_EQ(first->epoch, scene.epoch);
  }
  EXPECT_EQ(copy.scenes().size(), 2u);
}

// A record that is shown from a later moment, and pauses there, tells no change of a body.
TEST_F(CopyOfAWorld, asks_for_the_bodies_of_a_later_term_that_begins_further_on) {
  send_keyframe();
  while (!copy.take_requests(1).empty()) {
  }
  world.step(true);
  scene.epoch += 2;
  copy.announce(scene);
  copy.feed(state());
  std::vector<KeyframeRequest> requests;
  for (double now_s = 1; now_s < 3 && requests.empty(); now_s += 0.1) requests = copy.take_requests(now_s);
  ASSERT_EQ(requests.size(), 1u);
  EXPECT_EQ(requests[0].epoch, scene.epoch);
}

}  // namespace
}  // namespace sectio::test
