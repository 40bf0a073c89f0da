#include "render_client/replica/replica_scalars.h"

#include <gtest/gtest.h>

namespace sectio::replica_test {
namespace {

constexpr std::uint32_t kSlots = 200;  // two pieces

ScalarPiece piece_of(std::uint64_t step, std::uint64_t revision, std::uint32_t piece, std::uint16_t level) {
  const std::uint32_t count = piece == 0 ? kVerticesPerPiece : kSlots - kVerticesPerPiece;
  return {7, step, revision, 0, piece, "wetness", 0, 1, std::vector<std::uint16_t>(count, level)};
}

class Scalars : public testing::Test {
 protected:
  void settle(std::uint64_t revision) { scalars.accept_pieces(revision, changed_at, names); }
  float at(std::size_t v) const { return scalars.fields().at(0).values.at(v); }

  ReplicaScalars scalars;
  std::vector<std::uint64_t> changed_at = std::vector<std::uint64_t>(kSlots, 0);
  std::vector<std::string> names{"wetness"};
};

TEST_F(Scalars, of_each_piece_the_newest_holds_in_whatever_order_they_come) {
  scalars.feed(piece_of(2, 0, 0, kMostLevel));
  scalars.feed(piece_of(1, 0, 0, 0));  // late
  settle(0);
  EXPECT_EQ(at(0), 1);
  EXPECT_EQ(at(kSlots - 1), 0) << "none has come for it: the least";
  scalars.feed(piece_of(3, 0, 1, kMostLevel));
  settle(0);
  EXPECT_EQ(at(kSlots - 1), 1);
  EXPECT_EQ(scalars.fields()[0].values.size(), kSlots);
}

TEST_F(Scalars, values_of_a_newer_topology_wait_and_those_of_an_older_one_spare_slots_that_changed) {
  changed_at[5] = 3;
  scalars.feed(piece_of(1, 2, 0, kMostLevel));
  settle(3);
  EXPECT_EQ(at(4), 1);
  EXPECT_EQ(at(5), 0);
  scalars.feed(piece_of(2, 4, 0, kMostLevel / 2));
  settle(3);
  EXPECT_EQ(at(4), 1);
  settle(4);
  EXPECT_EQ(at(4), at(5));
  EXPECT_NEAR(at(4), 0.5, 1e-4);
}

TEST_F(Scalars, fields_that_the_state_does_not_name_are_gone_and_more_than_a_body_may_have_are_not_kept) {
  for (int i = 0; i < 100; ++i) {
    ScalarPiece piece = piece_of(1, 0, 0, 1);
    piece.name = "field " + std::to_string(i);
    scalars.feed(std::move(piece));
  }
  EXPECT_EQ(scalars.fields().size(), kMaxScalars);
  names = {"field 3"};
  settle(0);
  ASSERT_EQ(scalars.fields().size(), 1u);
  EXPECT_EQ(scalars.fields()[0].name, "field 3");
}

}  // namespace
}  // namespace sectio::replica_test
