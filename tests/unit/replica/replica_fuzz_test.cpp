// No crash, no growth, whatever arrives, and a mesh that only ever holds what the server's hash vouches for.
#include <gtest/gtest.h>

#include <set>

#include "render_client/replica/replica.h"
#include "sim_server/net/state_encoder.h"
#include "tests/support/moving_world.h"
#include "tests/support/random.h"

namespace sectio::replica_test {
namespace {

using test::MovingWorld;
constexpr std::uint64_t kEpoch = 7;

std::uint64_t some_number(test::Random& random, std::uint64_t near) {
  switch (random() % 4) {
    case 0:
      return ~0ull - random() % 3;
    case 1:
      return random();
    default:
      return near + random() % 8 - 4;
  }
}

void damage(TopologyDelta& delta, test::Random& random) {
  const auto number32 = [&](std::uint32_t near) { return static_cast<std::uint32_t>(some_number(random, near)); };
  switch (random() % 9) {
    case 0:
      delta.hash_after = some_number(random, delta.hash_after);
      break;
    case 1:
      delta.revision = some_number(random, delta.revision);
      delta.base_revision = delta.revision - 1;
      break;
    case 2:
      delta.vertex_slots_after = number32(delta.vertex_slots_after);
      break;
    case 3:
      delta.triangle_slots_after = number32(delta.triangle_slots_after);
      break;
    case 4:
      if (!delta.vertices.empty()) delta.vertices[random() % delta.vertices.size()].id = number32(10);
      break;
    case 5:
      if (!delta.vertices.empty()) delta.vertices[0].rest_body_m.x() += 1;
      break;
    case 6:
      delta.triangles[random() % delta.triangles.size()].triangle.v[random() % 3] = number32(10);
      break;
    case 7:
      delta.triangles.pop_back();
      break;
    default:
      delta.vertices.clear();
  }
}

class ReplicaFuzz : public testing::Test {
 protected:
  ReplicaFuzz() : encoder(kEpoch, MovingWorld::kStep_s, 1) {
    SceneInfo scene = world.scene("fuzz");
    scene.epoch = kEpoch;
    replica.reset(scene);
    hashes.insert(world.mesh().hash());
    replica.feed_keyframe(kEpoch, 0, to_bytes(keyframe_of(world.mesh())));
  }

  MovingWorld world{1};
  StateEncoder encoder;
  Replica replica;
  test::Random random{2024};
  std::set<std::uint64_t> hashes;  // hashes that the server had at any time
};

TEST_F(ReplicaFuzz, damaged_messages_neither_crash_nor_change_the_replica) {
  Frame frame;
  double now_s = 0;
  for (int i = 0; i < 4000; ++i, now_s += 0.01) {
    StepOutput output = world.step(random() % 4 == 0 && world.mesh().triangle_slots() < 2000);
    hashes.insert(world.mesh().hash());
    for (BodyDelta& body : output.deltas) {
      encoder.changed(0, body.delta);
      TopologyDelta bad = body.delta;
      damage(bad, random);
      replica.feed(DeltaMessage{kEpoch, static_cast<std::uint32_t>(random() % 2), bad});
      if (random() % 2) replica.feed(DeltaMessage{kEpoch, 0, body.delta});
    }
    StateSnapshot snapshot;
    snapshot.step = output.step;
    snapshot.bodies = {{world.mesh().revision(), world.positions()}};
    snapshot.tools = {{}};
    encoder.encode(snapshot);
    StateHeader header = encoder.header();
    if (random() % 3 == 0) header.step = some_number(random, header.step);
    if (random() % 3 == 0) header.bodies[0].revision = some_number(random, header.bodies[0].revision);
    if (random() % 10 == 0) header.bodies.resize(random() % 3);
    replica.feed(header);
    for (StatePiece piece : encoder.pieces()) {
      if (random() % 3 == 0) piece.step = some_number(random, piece.step);
      if (random() % 3 == 0) piece.revision = some_number(random, piece.revision);
      if (random() % 3 == 0) piece.piece = static_cast<std::uint32_t>(some_number(random, piece.piece) % 80'000);
      if (random() % 5 == 0) piece.offsets_quanta.resize(3 * (1 + random() % kVerticesPerPiece));
      if (random() % 5 == 0) piece.body_id = 1;
      replica.feed(piece);
    }
    replica.frame(now_s, frame);
    ASSERT_TRUE(hashes.count(replica.bodies()[0].mesh().hash()));
    if (!replica.take_requests(now_s).empty()) {
      std::vector<std::uint8_t> bytes = to_bytes(keyframe_of(world.mesh()));
      if (random() % 2) bytes[random() % bytes.size()] ^= 0x10;
      replica.feed_keyframe(kEpoch, 0, bytes);
      encoder.refresh(0);
    }
  }
  // Undamaged from now on: it finds its way back. (A keyframe damaged in nothing but its revision is the server's
  // topology under a wrong number; it is left for the next keyframe.)
  for (int i = 0; i < 20; ++i) replica.feed_keyframe(kEpoch, 0, to_bytes(keyframe_of(world.mesh())));
  replica.catch_up();
  EXPECT_TRUE(hashes.count(replica.bodies()[0].mesh().hash()));
}

TEST_F(ReplicaFuzz, memory_is_bounded_whatever_arrives) {
  TopologyDelta delta = test::split_triangle(world.mesh(), 0);
  for (std::uint64_t i = 0; i < 3 * ReplicaBody::kMaxQueuedDeltas; ++i) {
    delta.base_revision = 10 + i;
    delta.revision = 11 + i;
    replica.feed(DeltaMessage{kEpoch, 0, delta});
    ASSERT_LE(replica.bodies()[0].queued_deltas(), ReplicaBody::kMaxQueuedDeltas);
  }
  StatePiece piece{kEpoch, 0, 0, 0, 0, kQuantum_m, {}, std::vector<std::uint16_t>(3)};
  for (std::uint64_t i = 0; i < 3 * ReplicaBody::kMaxPieces; ++i) {
    piece.step = 1000 + i;
    piece.piece = static_cast<std::uint32_t>(random() % 80'000);
    replica.feed(piece);
    ASSERT_LE(replica.bodies()[0].queued_pieces(), ReplicaBody::kMaxPieces);
  }
}

}  // namespace
}  // namespace sectio::replica_test
