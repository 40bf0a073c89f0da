// Bytes that were damaged on their way, through all that a viewer does with them: decoded, validated, put together,
// applied. The replica only ever holds what the server had, and holds no more than it may.
#include <gtest/gtest.h>

#include <set>

#include "common/messages/chunks.h"
#include "common/messages/codec.h"
#include "render_client/replica/replica.h"
#include "sim_server/net/state_encoder.h"
#include "tests/support/damage.h"
#include "tests/support/moving_world.h"
#include "tests/support/random.h"

namespace sectio::replica_test {
namespace {

using test::damaged;
using test::MovingWorld;

constexpr std::uint64_t kWireEpoch = 7;
constexpr std::uint32_t kSmallChunks = 600;

class WireFuzz : public testing::Test {
 protected:
  WireFuzz() : encoder(kWireEpoch, MovingWorld::kStep_s, 1) {
    SceneInfo scene = world.scene("fuzz");
    scene.epoch = kWireEpoch;
    replica.reset(scene);
    hashes.insert(world.mesh().hash());
    replica.feed_keyframe(kWireEpoch, 0, to_bytes(keyframe_of(world.mesh())));
  }

  // The message as it arrives, if it does.
  template <class Message>
  std::optional<Message> over_the_wire(const Message& message, bool damage) {
    std::vector<std::uint8_t> bytes = encode(message);
    if (damage) bytes = damaged(std::move(bytes), random);
    std::optional<Message> valid = decode<Message>(bytes);
    if (damage && valid) ++survivors;
    return valid;
  }
  bool chance(unsigned one_in) { return random() % one_in == 0; }

  void step(bool hostile) {
    StepOutput output = world.step(chance(3) && world.mesh().triangle_slots() < 1000);
    hashes.insert(world.mesh().hash());
    for (const BodyDelta& body : output.deltas) {
      encoder.changed(0, body.delta);
      for (int copy = hostile ? 4 : 0; copy >= 0; --copy)
        if (auto m = over_the_wire(DeltaMessage{kWireEpoch, 0, body.delta}, copy > 0)) replica.feed(std::move(*m));
    }
    StateSnapshot snapshot;
    snapshot.step = output.step;
    snapshot.bodies = {{world.mesh().revision(), world.positions()}};
    snapshot.tools = {{}};
    encoder.encode(snapshot);
    if (auto m = over_the_wire(encoder.header(), hostile && chance(2))) replica.feed(std::move(*m));
    for (const StatePiece& piece : encoder.pieces())
      if (auto m = over_the_wire(piece, hostile && chance(2))) replica.feed(std::move(*m));
    now_s += 0.01;
    replica.frame(now_s, frame);
  }
  // Feeds chunks in the way of ClientNet.
  void keyframe(bool hostile) {
    const std::vector<std::uint8_t> bytes = to_bytes(keyframe_of(world.mesh()));
    for (const KeyframeChunk& chunk : split_keyframe(kWireEpoch, 0, world.mesh().revision(), bytes, kSmallChunks))
      if (auto m = over_the_wire(chunk, hostile && chance(20)); m && m->epoch == kWireEpoch && m->body_id == 0)
        if (const auto whole = assembler.add(std::move(*m))) replica.feed_keyframe(kWireEpoch, 0, *whole);
    encoder.refresh(0);
  }
  void expect_sound() {
    const ReplicaBody& body = replica.bodies().at(0);
    ASSERT_TRUE(hashes.count(body.mesh().hash()));
    ASSERT_LE(body.queued_deltas(), ReplicaBody::kMaxQueuedDeltas);
    ASSERT_LE(body.queued_pieces(), ReplicaBody::kMaxPieces);
  }

  MovingWorld world{1};
  StateEncoder encoder;
  Replica replica;
  KeyframeAssembler assembler;
  Frame frame;
  test::Random random{31};
  std::set<std::uint64_t> hashes;  // hashes that the server had at any time
  double now_s = 0;
  int survivors = 0;  // damaged, and still valid as far as one message can tell
};

TEST_F(WireFuzz, damaged_deltas_keyframes_and_states_leave_the_replica_sound) {
  for (int i = 0; i < 3000; ++i) {
    step(true);
    if (!replica.take_requests(now_s).empty() || chance(50)) keyframe(true);
    ASSERT_NO_FATAL_FAILURE(expect_sound());
  }
  EXPECT_GT(survivors, 1000);
  // From now on nothing is damaged: it finds its way back.
  for (int i = 0; i < 3000 && replica.bodies()[0].mesh().hash() != world.mesh().hash(); ++i) {
    step(false);
    if (!replica.take_requests(now_s).empty()) keyframe(false);
  }
  replica.catch_up();
  EXPECT_EQ(replica.bodies()[0].mesh().hash(), world.mesh().hash());
}

}  // namespace
}  // namespace sectio::replica_test
