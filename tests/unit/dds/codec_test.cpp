#include "common/messages/codec.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/messages/session_fields.h"
#include "common/messages/state_fields.h"
#include "common/messages/text.h"
#include "common/messages/tool_fields.h"
#include "common/messages/topology_fields.h"
#include "common/messages/validate.h"
#include "tests/unit/dds/messages.h"

namespace sectio::dds_test {
namespace {

using namespace test;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The message with one thing changed, as a receiver gets it.
template <class Message, class Change>
auto received(Message message, const Change& change) {
  change(message);
  return decode<Message>(encode(message));
}
template <class Message>
auto received(const Message& message) {
  return decode<Message>(encode(message));
}
template <class Message, class Change>
bool is_refused(const Message& message, const Change& change) {
  EXPECT_TRUE(received(message)) << first_flaw(message);
  return !received(message, change);
}

TEST(Codec, brings_every_message_back_bit_for_bit) {
  int count = 0;
  for_each_message([&](const auto& message) {
    ++count;
    ASSERT_EQ(first_flaw(message), "");
    const auto back = received(message);
    ASSERT_TRUE(back);
    EXPECT_EQ(to_text(*back), to_text(message));
    EXPECT_EQ(encode(*back), encode(message));
  });
  EXPECT_EQ(count, kMessages);
}

// fields() of a message binds every member, so that one that is added doesn't compile until it is bound. This says that
// every one is visited, too: a member that isn't would come back as its default.
TEST(Codec, leaves_out_no_field_of_any_message) {
  EXPECT_EQ(received(some_delta())->delta, some_delta().delta);
  EXPECT_EQ(received(some_delta())->body_id, some_delta().body_id);
  EXPECT_EQ(received(some_chunk())->bytes, some_chunk().bytes);
  EXPECT_EQ(received(some_scalars())->levels, some_scalars().levels);
  EXPECT_EQ(received(some_status())->checks, some_status().checks);
  EXPECT_EQ(received(some_status())->bodies, some_status().bodies);
  EXPECT_EQ(received(some_end())->reason, some_end().reason);
  EXPECT_EQ(received(some_order())->gravity_m_per_s2, some_order().gravity_m_per_s2);
  EXPECT_EQ(received(some_packet())->samples[1].opening_rad, 0.4);
  EXPECT_EQ(received(some_scene())->bodies[0].regions[0].parts[1].radius_b_m, 0.001);
  EXPECT_EQ(received(some_scene())->floor_z_m, some_scene().floor_z_m);
  SceneInfo floating = some_scene();
  floating.floor_z_m.reset();
  EXPECT_FALSE(received(floating)->floor_z_m);
}

TEST(Codec, puts_a_piece_and_its_transport_into_one_packet) {
  StatePiece piece = some_piece();
  piece.offsets_quanta.assign(3 * kVerticesPerPiece, 1);
  ScalarPiece scalars = some_scalars();
  scalars.name.assign(kMaxNameBytes, 'a');
  scalars.levels.assign(kVerticesPerPiece, 1);
  constexpr std::size_t kRtpsAndUdpBytes = 20 + 12 + 16 + 28 + 28;
  EXPECT_LE(encode(piece).size() + kRtpsAndUdpBytes, 1400u);
  EXPECT_LE(encode(scalars).size() + kRtpsAndUdpBytes, 1400u);
}

TEST(Codec, refuses_tool_packets_that_no_hand_could_have_sent) {
  const auto refused = [](const auto& change) { return is_refused(some_packet(), change); };
  EXPECT_TRUE(refused([](ToolPacket& p) { p.samples[1].sequence = 5; }));
  EXPECT_TRUE(refused([](ToolPacket& p) { p.samples[0].pose_world.position_m.x() = kNan; }));
  EXPECT_TRUE(refused([](ToolPacket& p) { p.samples[0].pose_world.orientation.coeffs() *= 2; }));
  EXPECT_TRUE(refused([](ToolPacket& p) { p.samples[0].tool_time_s = std::numeric_limits<double>::infinity(); }));
  EXPECT_TRUE(refused([](ToolPacket& p) { p.tool_id = kMaxTools; }));
  EXPECT_TRUE(refused([](ToolPacket& p) { p.samples.clear(); }));
  EXPECT_TRUE(refused([](ToolPacket& p) { p.samples.resize(kMaxPosesPerPacket + 1); }));
  for (const double opening_rad : {-0.1, 4.0, kNan})
    EXPECT_TRUE(refused([&](ToolPacket& p) { p.samples[1].opening_rad = opening_rad; }));
}

TEST(Codec, refuses_contact_models_that_could_shake_a_hand) {
  const auto refused = [](const auto& change) { return is_refused(some_contact(), change); };
  EXPECT_TRUE(refused([](ContactMessage& m) { m.model.stiffness_n_per_m = -1; }));
  EXPECT_TRUE(refused([](ContactMessage& m) { m.model.normal_world = Vec3(0, 0, 2); }));
  EXPECT_TRUE(refused([](ContactMessage& m) { m.model.force_world_n.y() = kNan; }));
  EXPECT_TRUE(refused([](ContactMessage& m) { m.model.state = static_cast<ContactState>(4); }));
}

TEST(Codec, refuses_deltas_that_are_none) {
  const auto refused = [](const auto& change) { return is_refused(some_delta(), change); };
  EXPECT_TRUE(refused([](DeltaMessage& m) { m.delta.revision = m.delta.base_revision; }));
  EXPECT_TRUE(refused([](DeltaMessage& m) { m.delta.revision = 0, m.delta.base_revision = ~0ull; }));
  EXPECT_TRUE(refused([](DeltaMessage& m) { m.body_id = kMaxBodies; }));
  EXPECT_TRUE(refused([](DeltaMessage& m) { m.delta.vertex_slots_after = kMaxVertexSlots + 1; }));
  EXPECT_TRUE(refused([](DeltaMessage& m) { m.delta.vertices[1].id = 3; }));
  EXPECT_TRUE(refused([](DeltaMessage& m) { m.delta.vertices[0].rest_body_m[1] = kNan; }));
  EXPECT_TRUE(refused([](DeltaMessage& m) { m.delta.triangles[0].triangle.surface = static_cast<Surface>(2); }));
  EXPECT_TRUE(refused([](DeltaMessage& m) { m.delta.triangles[0].triangle.v[2] = kNone; }));
}

TEST(Codec, refuses_states_whose_sizes_disagree) {
  const auto header_refused = [](const auto& change) { return is_refused(some_header(), change); };
  EXPECT_TRUE(header_refused([](StateHeader& h) { h.bodies[0].pieces_sent = {1, 2}; }));
  EXPECT_TRUE(header_refused([](StateHeader& h) { h.bodies[0].pieces_sent = {0b1000}; })) << "a fourth piece of three";
  EXPECT_TRUE(header_refused([](StateHeader& h) { h.bodies[0].scalars.assign(kMaxScalars + 1, "wetness"); }));
  EXPECT_TRUE(header_refused([](StateHeader& h) { h.bodies[0].scalars[1] = ""; }));
  const auto piece_refused = [](const auto& change) { return is_refused(some_piece(), change); };
  EXPECT_TRUE(piece_refused([](StatePiece& p) { p.offsets_quanta.pop_back(); }));
  EXPECT_TRUE(piece_refused([](StatePiece& p) { p.offsets_quanta.assign(3 * kVerticesPerPiece + 3, 0); }));
  for (const double quantum_m : {0.0, -kQuantum_m, kQuantum_m / 2, kQuantum_m * 3, kNan, 1e300})
    EXPECT_TRUE(piece_refused([&](StatePiece& p) { p.quantum_m = quantum_m; })) << quantum_m;
  const auto scalars_refused = [](const auto& change) { return is_refused(some_scalars(), change); };
  EXPECT_TRUE(scalars_refused([](ScalarPiece& p) { p.most = p.least; }));
  EXPECT_TRUE(scalars_refused([](ScalarPiece& p) { p.least = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(scalars_refused([](ScalarPiece& p) { p.levels.resize(kVerticesPerPiece + 1); }));
}

TEST(Codec, refuses_chunks_that_would_not_add_up) {
  const auto refused = [](const auto& change) { return is_refused(some_chunk(), change); };
  EXPECT_TRUE(refused([](KeyframeChunk& c) { c.chunks = 4; }));
  EXPECT_TRUE(refused([](KeyframeChunk& c) { c.chunk = 3; }));
  EXPECT_TRUE(refused([](KeyframeChunk& c) { c.total_bytes = kMaxKeyframeBytes + 1; }));
  EXPECT_TRUE(refused([](KeyframeChunk& c) { c.bytes.clear(); }));
}

TEST(Codec, refuses_scenes_that_can_not_be_shown) {
  const auto refused = [](const auto& change) { return is_refused(some_scene(), change); };
  EXPECT_TRUE(refused([](SceneInfo& s) { s.bodies[0].name = "liver\n"; }));
  EXPECT_TRUE(refused([](SceneInfo& s) { s.bodies[0].skin_colour.x() = 1.5; }));
  EXPECT_TRUE(refused([](SceneInfo& s) { s.step_s = 0; }));
  EXPECT_TRUE(refused([](SceneInfo& s) { s.camera.field_of_view_deg = kNan; }));
  EXPECT_TRUE(refused([](SceneInfo& s) { s.bodies[0].regions[0].parts.clear(); }));
  EXPECT_TRUE(is_refused(some_order(), [](SessionOrder& g) { g.gravity_m_per_s2.z() = -2000; }));
  EXPECT_TRUE(is_refused(some_order(), [](SessionOrder& g) { g.gravity_m_per_s2.y() = kNan; }));
  EXPECT_TRUE(is_refused(some_order(), [](SessionOrder& g) { g.speed = 0; }));
  EXPECT_TRUE(is_refused(some_order(), [](SessionOrder& g) { g.sim_time_s = -1; }));
  EXPECT_TRUE(is_refused(some_order(), [](SessionOrder& g) { g.kind = static_cast<OrderKind>(77); }));
}

TEST(Validate, names_the_field_that_is_wrong) {
  SceneInfo scene = some_scene();
  scene.bodies.push_back(scene.bodies[0]);
  scene.bodies[1].name.clear();
  EXPECT_EQ(first_flaw(scene), "bodies[1].name: too long or too short");
  scene = some_scene();
  scene.camera.eye_world_m.x() = 1e9;
  EXPECT_EQ(first_flaw(scene), "camera.eye_world_m: expected -10000 to 10000, got 1e+09");
  SessionOrder order = some_order();
  order.sim_time_s = -1;
  EXPECT_EQ(first_flaw(order), "sim_time_s: expected >= 0, got -1");
}

TEST(Text, names_every_field_and_shortens_long_sequences) {
  EXPECT_EQ(to_text(some_request()),
            "epoch: 7, body_id: 1, known_revision: 5, client: 42, revision: 6, "
            "first_chunk: 32, chunks: 64");
  EXPECT_EQ(to_text(some_order()),
            "source: 7, kind: 3, gravity_world_m_per_s2: [3, 0, -9], speed_1: 0.5, sim_time_s: 0, tool_id: 0");
  EXPECT_EQ(to_text(some_end()), "epoch: 7, step: 100, reason: 'duration', bodies: [{revision: 5, topology_hash: 99}]");
  KeyframeChunk chunk = some_chunk();
  chunk.bytes.assign(1000, 1);
  EXPECT_NE(to_text(chunk).find("bytes: [1, 1, 1, 1, 1, 1, 1, 1, ... of 1000]"), std::string::npos) << to_text(chunk);
}

}  // namespace
}  // namespace sectio::dds_test
