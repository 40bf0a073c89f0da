#include "common/dds/convert.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/dds/endpoint.h"
#include "tests/unit/dds/messages.h"

namespace sectio {
namespace {

using namespace test;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Through the bytes and back: what a receiver gets.
template <class Wire>
auto received(const Wire& sent) {
  Wire message;
  EXPECT_TRUE(decode(encode(sent), message));
  return from_wire(message);
}

template <class Wire>
bool same_bytes(const Wire& a, const Wire& b) {
  return encode(a) == encode(b);
}

TEST(Convert, every_message_comes_back_bit_for_bit) {
  EXPECT_TRUE(same_bytes(to_wire(some_packet()), to_wire(received(to_wire(some_packet())).value())));
  EXPECT_TRUE(same_bytes(to_wire(some_model(), 7), to_wire(received(to_wire(some_model(), 7)).value().model, 7)));
  EXPECT_EQ(received(to_wire(some_delta())).value().delta, some_delta().delta);
  EXPECT_EQ(received(to_wire(some_delta())).value().body_id, some_delta().body_id);
  EXPECT_EQ(received(to_wire(some_chunk())).value().bytes, some_chunk().bytes);
  EXPECT_TRUE(same_bytes(to_wire(some_chunk()), to_wire(received(to_wire(some_chunk())).value())));
  EXPECT_TRUE(same_bytes(to_wire(some_header()), to_wire(received(to_wire(some_header())).value())));
  EXPECT_TRUE(same_bytes(to_wire(some_piece()), to_wire(received(to_wire(some_piece())).value())));
  EXPECT_TRUE(same_bytes(to_wire(some_scene()), to_wire(received(to_wire(some_scene())).value())));
  EXPECT_TRUE(same_bytes(to_wire(some_event()), to_wire(received(to_wire(some_event())).value())));
  EXPECT_TRUE(same_bytes(to_wire(some_status()), to_wire(received(to_wire(some_status())).value())));
  EXPECT_TRUE(same_bytes(to_wire(some_end()), to_wire(received(to_wire(some_end())).value())));
  EXPECT_EQ(received(to_wire(GravityRequest{7, Vec3(3, 0, -9)})).value().gravity_m_per_s2, Vec3(3, 0, -9));
  EXPECT_FALSE(received(to_wire(GravityRequest{7, Vec3(3, kNan, -9)})));
  EXPECT_FALSE(received(to_wire(GravityRequest{7, Vec3(0, 0, -2000)})));
  const KeyframeRequest request{7, 1, kNoRevision, 42};
  EXPECT_EQ(received(to_wire(request)).value().known_revision, kNoRevision);
}

TEST(Convert, a_piece_and_its_transport_fit_into_one_packet) {
  StatePiece piece = some_piece();
  piece.offsets_quanta.assign(3 * kVerticesPerPiece, 1);
  constexpr std::size_t kRtpsAndUdpBytes = 20 + 12 + 16 + 28 + 28;
  EXPECT_LE(encode(to_wire(piece)).size() + kRtpsAndUdpBytes, 1400u);
}

TEST(Convert, tool_packets_are_refused_when_no_hand_could_have_sent_them) {
  ToolPacket packet = some_packet();
  packet.samples[1].sequence = 5;
  EXPECT_FALSE(from_wire(to_wire(packet)));
  packet = some_packet();
  packet.samples[0].pose_world.position_m.x() = kNan;
  EXPECT_FALSE(from_wire(to_wire(packet)));
  packet = some_packet();
  packet.samples[0].pose_world.orientation.coeffs() *= 2;
  EXPECT_FALSE(from_wire(to_wire(packet)));
  packet = some_packet();
  packet.samples[0].tool_time_s = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(from_wire(to_wire(packet)));
  packet = some_packet();
  packet.tool_id = kMaxTools;
  EXPECT_FALSE(from_wire(to_wire(packet)));
  packet = some_packet();
  EXPECT_EQ(from_wire(to_wire(packet)).value().samples[1].opening_rad, 0.4);
  for (const double opening_rad : {-0.1, 4.0, kNan}) {
    packet.samples[1].opening_rad = opening_rad;
    EXPECT_FALSE(from_wire(to_wire(packet)));
  }
  packet = some_packet();
  packet.samples.clear();
  EXPECT_FALSE(from_wire(to_wire(packet)));
}

TEST(Convert, contact_models_are_refused_when_they_could_shake_a_hand) {
  wire::ContactModel m = to_wire(some_model(), 7);
  m.stiffness_n_per_m(-1);
  EXPECT_FALSE(from_wire(m));
  m = to_wire(some_model(), 7);
  m.normal_world({0, 0, 2});
  EXPECT_FALSE(from_wire(m));
  m = to_wire(some_model(), 7);
  m.force_world_n({0, kNan, 0});
  EXPECT_FALSE(from_wire(m));
  m = to_wire(some_model(), 7);
  m.state(3);
  EXPECT_FALSE(from_wire(m));
}

TEST(Convert, deltas_are_refused_when_they_are_none) {
  const auto refused = [](auto&& damage) {
    wire::TopologyDelta m = to_wire(some_delta());
    damage(m);
    return !from_wire(m).has_value();
  };
  EXPECT_FALSE(refused([](wire::TopologyDelta&) {}));
  EXPECT_TRUE(refused([](wire::TopologyDelta& m) { m.revision(7); }));
  EXPECT_TRUE(refused([](wire::TopologyDelta& m) { m.revision(0), m.base_revision(~0ull); }));
  EXPECT_TRUE(refused([](wire::TopologyDelta& m) { m.body_id(kMaxBodies); }));
  EXPECT_TRUE(refused([](wire::TopologyDelta& m) { m.vertex_slots_after(kMaxVertexSlots + 1); }));
  EXPECT_TRUE(refused([](wire::TopologyDelta& m) { m.vertices()[1].slot(3); }));
  EXPECT_TRUE(refused([](wire::TopologyDelta& m) { m.vertices()[0].rest_body_m()[1] = kNan; }));
  EXPECT_TRUE(refused([](wire::TopologyDelta& m) { m.triangles()[0].surface(2); }));
  EXPECT_TRUE(refused([](wire::TopologyDelta& m) { m.triangles()[0].corners()[2] = kNone; }));
}

TEST(Convert, states_are_refused_when_sizes_disagree) {
  wire::StateHeader header = to_wire(some_header());
  header.bodies()[0].pieces_sent({1, 2});
  EXPECT_FALSE(from_wire(header));
  header = to_wire(some_header());
  header.bodies()[0].pieces_sent({0b1000});  // a fourth piece of three
  EXPECT_FALSE(from_wire(header));
  wire::StatePiece piece = to_wire(some_piece());
  piece.offsets_quanta().pop_back();
  EXPECT_FALSE(from_wire(piece));
  piece = to_wire(some_piece());
  piece.offsets_quanta().assign(3 * kVerticesPerPiece + 3, 0);
  EXPECT_FALSE(from_wire(piece));
  for (const double quantum_m : {0.0, -kQuantum_m, kQuantum_m / 2, kQuantum_m * 3, kNan, 1e300}) {
    piece = to_wire(some_piece());
    piece.quantum_m(quantum_m);
    EXPECT_FALSE(from_wire(piece)) << quantum_m;
  }
}

TEST(Convert, chunks_are_refused_when_they_would_not_add_up) {
  wire::KeyframeChunk m = to_wire(some_chunk());
  m.chunks(4);
  EXPECT_FALSE(from_wire(m));
  m = to_wire(some_chunk());
  m.chunk(3);
  EXPECT_FALSE(from_wire(m));
  m = to_wire(some_chunk());
  m.total_bytes(kMaxKeyframeBytes + 1);
  EXPECT_FALSE(from_wire(m));
  m = to_wire(some_chunk());
  m.bytes().clear();
  EXPECT_FALSE(from_wire(m));
}

TEST(Convert, scenes_are_refused_when_they_can_not_be_shown) {
  SceneInfo scene = some_scene();
  scene.bodies[0].name = "liver\n";
  EXPECT_FALSE(from_wire(to_wire(scene)));
  scene = some_scene();
  scene.bodies[0].skin_colour.x() = 1.5;
  EXPECT_FALSE(from_wire(to_wire(scene)));
  scene = some_scene();
  scene.step_s = 0;
  EXPECT_FALSE(from_wire(to_wire(scene)));
  scene = some_scene();
  scene.camera.field_of_view_deg = kNan;
  EXPECT_FALSE(from_wire(to_wire(scene)));
}

}  // namespace
}  // namespace sectio
