// Damaged tool packets on their way into the simulation: dropped, or poses that it survives.
#include <gtest/gtest.h>

#include "common/messages/codec.h"
#include "sim_server/net/sample_deduplicator.h"
#include "tests/support/damage.h"
#include "tests/support/operation.h"
#include "tests/support/random.h"

namespace sectio::net_test {
namespace {

struct Survived {
  int damaged_ones = 0;
  std::size_t deltas = 0;
};

void survive(std::uint32_t seed, Survived& survived) {
  test::Operation op(test::organ_scene());
  SampleDeduplicator deduplicator(1);
  test::Random random(seed);
  StepInput input;
  for (std::uint64_t i = 1; i <= 3000; ++i) {
    // To and fro through the upper side, 15 mm deep at most.
    const double phase = static_cast<double>(i) * 0.01;
    const Pose pose{Vec3(0.03 * std::sin(phase), 0.01, test::kOrganTop_m - 0.015 * std::sin(0.37 * phase)),
                    {1, 0, 0, 0}};
    const ToolPacket packet{77, 0, {{0, i, static_cast<double>(i) * 0.001, pose}}};
    std::vector<std::uint8_t> bytes = encode(packet);
    const bool damage = random() % 10 == 0;
    if (damage) bytes = test::damaged(std::move(bytes), random);
    input.samples.clear();
    if (const auto valid = decode<ToolPacket>(bytes)) {
      survived.damaged_ones += damage;
      deduplicator.accept(*valid, static_cast<double>(i) * 0.001, input.samples);
    }
    ASSERT_LE(input.samples.size(), 64u);
    op.step(input);
    for (const ContactModel& contact : op.last.contacts) ASSERT_TRUE(contact.force_world_n.allFinite()) << "step " << i;
    if (i % 100 == 0) {
      ASSERT_NO_FATAL_FAILURE(op.expect_valid());
    }
  }
  survived.deltas += op.deltas;
  op.expect_valid();
  for (const Vec3f& x : op.simulation.positions_world_m(0)) ASSERT_TRUE(x.allFinite());
}

// Damage to a source or a sequence number makes ghosts of all that comes after it, so several sessions are tried.
TEST(ToolFuzz, damaged_poses_leave_a_valid_finite_body) {
  Survived survived;
  for (std::uint32_t seed = 1; seed <= 8; ++seed) ASSERT_NO_FATAL_FAILURE(survive(seed, survived)) << seed;
  EXPECT_GT(survived.damaged_ones, 100);
  EXPECT_GT(survived.deltas, 100u);
}

}  // namespace
}  // namespace sectio::net_test
