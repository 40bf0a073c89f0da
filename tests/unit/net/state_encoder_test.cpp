#include "sim_server/net/state_encoder.h"

#include <gtest/gtest.h>

#include <limits>

namespace sectio::net_test {
namespace {

constexpr std::uint32_t kSlots = 1000;  // six pieces

StateSnapshot snapshot_of(std::uint64_t step, const std::vector<Vec3f>& positions, std::uint64_t revision = 0) {
  StateSnapshot snapshot;
  snapshot.step = step;
  snapshot.bodies = {{revision, positions}};
  return snapshot;
}

std::vector<Vec3f> line() {
  std::vector<Vec3f> positions;
  for (std::uint32_t i = 0; i < kSlots; ++i) positions.emplace_back(0.0002f * static_cast<float>(i), 0.01f, -0.02f);
  return positions;
}

TEST(StateEncoder, all_pieces_first_and_each_within_half_a_quantum) {
  StateEncoder encoder(7, 0.001, 1);
  const std::vector<Vec3f> positions = line();
  encoder.encode(snapshot_of(5, positions));
  ASSERT_EQ(encoder.pieces().size(), piece_count(kSlots));
  EXPECT_DOUBLE_EQ(encoder.header().sim_time_s, 0.005);
  for (const StatePiece& piece : encoder.pieces())
    for (std::uint32_t i = 0; i < piece.vertices(); ++i)
      EXPECT_LE((piece.position_m(i) - positions[piece.piece * kVerticesPerPiece + i]).cwiseAbs().maxCoeff(),
                0.51 * kQuantum_m);
}

TEST(StateEncoder, a_piece_that_spans_more_than_16_bits_gets_coarser) {
  StateEncoder encoder(7, 0.001, 1);
  std::vector<Vec3f> positions = {Vec3f(-3, 0, 0), Vec3f(4, 0, 0)};
  encoder.encode(snapshot_of(1, positions));
  ASSERT_EQ(encoder.pieces().size(), 1u);
  EXPECT_GT(encoder.pieces()[0].quantum_m, kQuantum_m);
  EXPECT_NEAR(encoder.pieces()[0].position_m(1).x(), 4, encoder.pieces()[0].quantum_m);
}

TEST(StateEncoder, at_rest_only_whose_turn_it_is_is_sent_and_everybodys_comes_within_a_second) {
  StateEncoder encoder(7, 0.001, 1);
  const std::vector<Vec3f> positions = line();
  encoder.encode(snapshot_of(0, positions));
  std::vector<int> sent(piece_count(kSlots));
  for (std::uint32_t frame = 1; frame <= StateEncoder::Fineness{}.frames_per_refresh; ++frame) {
    encoder.encode(snapshot_of(frame, positions));
    EXPECT_LE(encoder.pieces().size(), 1u);
    for (const StatePiece& piece : encoder.pieces()) {
      ++sent[piece.piece];
      EXPECT_TRUE(encoder.header().bodies[0].sent(piece.piece));
    }
  }
  EXPECT_EQ(sent, std::vector<int>(piece_count(kSlots), 1));
}

TEST(StateEncoder, a_refresh_is_spread_over_states_and_what_moves_does_not_wait_for_it) {
  StateEncoder encoder(7, 0.001, 1, {.frames_per_refresh = 1000, .most_refreshed = 1});
  std::vector<Vec3f> positions = line();
  const std::uint32_t pieces = piece_count(kSlots);
  std::vector<int> sent(pieces);
  ASSERT_GT(pieces, 2u);
  for (std::uint32_t frame = 1; frame <= pieces; ++frame) {
    encoder.encode(snapshot_of(frame, positions));
    positions.back().z() += 0.001f;
    EXPECT_LE(encoder.pieces().size(), 2u);
    EXPECT_EQ(encoder.header().bodies[0].sent(pieces - 1), frame > 1);
    EXPECT_EQ(encoder.is_refreshing(), frame + 1 < pieces) << "frame " << frame;
    for (const StatePiece& piece : encoder.pieces()) ++sent[piece.piece];
  }
  for (std::uint32_t p = 0; p + 1 < pieces; ++p) EXPECT_EQ(sent[p], 1) << "piece " << p;
  encoder.refresh(0);
  encoder.encode(snapshot_of(pieces + 1, positions), true);
  EXPECT_EQ(encoder.pieces().size(), pieces);
  EXPECT_FALSE(encoder.is_refreshing());
}

TEST(StateEncoder, what_moved_is_sent_and_slow_drift_adds_up) {
  StateEncoder encoder(7, 0.001, 1);
  std::vector<Vec3f> positions = line();
  encoder.encode(snapshot_of(0, positions));
  int sent = 0;
  for (std::uint32_t frame = 1; frame <= 20; ++frame) {  // a fifth of a quantum a frame, four quanta in all
    positions[200].x() += static_cast<float>(kQuantum_m / 5);
    encoder.encode(snapshot_of(frame, positions));
    for (const StatePiece& piece : encoder.pieces()) sent += piece.piece == 1;
  }
  EXPECT_GE(sent, 2);
  EXPECT_LE(sent, 4);
}

TEST(StateEncoder, changed_slots_are_sent_with_the_first_state_of_their_revision_and_repeated) {
  StateEncoder encoder(7, 0.001, 1);
  const std::vector<Vec3f> positions = line();
  encoder.encode(snapshot_of(0, positions, 4));
  TopologyDelta delta;
  delta.revision = 5;
  delta.vertices = {{900, true, Vec3::Zero()}};
  encoder.changed(0, delta);
  encoder.encode(snapshot_of(1, positions, 4));
  EXPECT_FALSE(encoder.header().bodies[0].sent(4));  // the state is older than the change
  for (std::uint64_t step = 2; step < 2 + StateEncoder::kRepeats; ++step) {
    encoder.encode(snapshot_of(step, positions, 5));
    EXPECT_TRUE(encoder.header().bodies[0].sent(4)) << step;
  }
  encoder.encode(snapshot_of(9, positions, 5));
  EXPECT_FALSE(encoder.header().bodies[0].sent(4));
}

TEST(StateEncoder, positions_that_are_no_numbers_stay_where_they_were) {
  StateEncoder encoder(7, 0.001, 1);
  std::vector<Vec3f> positions = line();
  encoder.encode(snapshot_of(0, positions));
  const Vec3f before = encoder.pieces()[0].position_m(3);
  positions[3].y() = std::numeric_limits<float>::quiet_NaN();
  positions[4].y() += 1;
  encoder.encode(snapshot_of(1, positions));
  ASSERT_GE(encoder.pieces().size(), 1u);
  EXPECT_EQ(encoder.pieces()[0].piece, 0u);
  EXPECT_LE((encoder.pieces()[0].position_m(3) - before).norm(), 2 * encoder.pieces()[0].quantum_m);
}

TEST(StateEncoder, scalars_are_sent_where_they_changed_and_named_by_every_header) {
  StateEncoder encoder(7, 0.001, 1);
  StateSnapshot snapshot = snapshot_of(1, line());
  encoder.encode(snapshot);
  EXPECT_TRUE(encoder.header().bodies[0].scalars.empty());
  EXPECT_TRUE(encoder.scalar_pieces().empty());

  snapshot.bodies[0].scalars = {{"wetness", 0, 1, std::vector<float>(kSlots, 0.5f)}};
  snapshot.step = 2;
  encoder.encode(snapshot);
  EXPECT_EQ(encoder.header().bodies[0].scalars, std::vector<std::string>{"wetness"});
  EXPECT_EQ(encoder.scalar_pieces().size(), piece_count(kSlots));

  snapshot.bodies[0].scalars[0].values[kVerticesPerPiece] = 0.75f;
  snapshot.bodies[0].scalars[0].values[0] = 0.5001f;  // no eye would see that
  snapshot.step = 3;
  encoder.encode(snapshot);
  ASSERT_EQ(encoder.scalar_pieces().size(), 1u);
  EXPECT_EQ(encoder.scalar_pieces()[0].piece, 1u);
  EXPECT_EQ(encoder.scalar_pieces()[0].levels[0], to_level(0.75f, 0, 1));
  EXPECT_EQ(encoder.header().bodies[0].scalars.size(), 1u);
}

TEST(StateEncoder, scalars_that_viewers_would_refuse_are_left_out) {
  StateEncoder encoder(7, 0.001, 1);
  StateSnapshot snapshot = snapshot_of(1, line());
  const std::vector<float> values(kSlots, 1);
  snapshot.bodies[0].scalars = {
      {"", 0, 1, values}, {"flat", 1, 1, values}, {"fine", 0, 1, values}, {"fine", 0, 2, values}};
  encoder.encode(snapshot);
  EXPECT_EQ(encoder.header().bodies[0].scalars, std::vector<std::string>{"fine"});
  EXPECT_EQ(encoder.scalar_pieces().size(), piece_count(kSlots));
}

TEST(Scalar, levels_cover_the_range_and_cut_off_what_is_beyond) {
  EXPECT_EQ(to_level(20, 20, 90), 0);
  EXPECT_EQ(to_level(90, 20, 90), kMostLevel);
  EXPECT_EQ(to_level(-5, 20, 90), 0);
  EXPECT_EQ(to_level(500, 20, 90), kMostLevel);
  EXPECT_EQ(to_level(std::numeric_limits<float>::quiet_NaN(), 20, 90), 0);
  for (const float value : {20.0f, 36.6f, 54.2f, 90.0f})
    EXPECT_NEAR(from_level(to_level(value, 20, 90), 20, 90), value, 70.0 / 65535);
}

}  // namespace
}  // namespace sectio::net_test
