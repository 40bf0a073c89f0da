#include "sim_server/net/sample_deduplicator.h"

#include <gtest/gtest.h>

#include "tests/support/operation.h"

namespace sectio {
namespace {

ToolPacket packet_of(std::uint64_t source, std::initializer_list<std::uint64_t> sequences) {
  ToolPacket packet{source, 0, {}};
  for (const std::uint64_t sequence : sequences) packet.samples.push_back({0, sequence, 0, {}});
  return packet;
}

TEST(SampleDeduplicator, passes_each_pose_once_and_in_order_though_packets_repeat_and_get_lost) {
  SampleDeduplicator deduplicator(1);
  std::vector<ToolSample> samples;
  deduplicator.accept(packet_of(1, {1}), samples);
  deduplicator.accept(packet_of(1, {1, 2}), samples);
  deduplicator.accept(packet_of(1, {2, 3, 4, 5}), samples);  // two packets were lost, no pose
  deduplicator.accept(packet_of(1, {2, 3, 4}), samples);     // late
  deduplicator.accept(packet_of(1, {8, 9}), samples);
  std::vector<std::uint64_t> sequences;
  for (const ToolSample& sample : samples) sequences.push_back(sample.sequence);
  EXPECT_EQ(sequences, (std::vector<std::uint64_t>{1, 2, 3, 4, 5, 8, 9}));
  EXPECT_EQ(deduplicator.lost(), 2u);
}

TEST(SampleDeduplicator, lets_a_restarted_bridge_replace_the_old_one) {
  SampleDeduplicator deduplicator(1);
  std::vector<ToolSample> samples;
  deduplicator.accept(packet_of(1, {100}), samples);
  deduplicator.accept(packet_of(2, {1}), samples);
  deduplicator.accept(packet_of(1, {101}), samples);
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ(samples[0].source, 1u);
  EXPECT_EQ(samples[1].source, 2u);
  EXPECT_EQ(deduplicator.refused(), 1u);
  ToolPacket unknown = packet_of(2, {2});
  unknown.tool_id = 1;
  deduplicator.accept(unknown, samples);
  EXPECT_EQ(deduplicator.refused(), 2u);
}

// A bridge with the scalpel at rest, then another one that moves it: what the simulation makes of both.
TEST(RestartedBridge, moves_its_instrument_from_its_first_sample_on) {
  test::Operation operation(test::organ_scene());
  SampleDeduplicator deduplicator(1);
  const auto step = [&](std::uint64_t source, std::uint64_t sequence, const Vec3& tip_m) {
    const ToolSample sample{
        0, sequence, static_cast<double>(sequence) * 0.001, {tip_m, Eigen::Quaterniond::Identity()}};
    StepInput input;
    deduplicator.accept({source, 0, {sample}}, input.samples);
    operation.step(input);
  };
  const Vec3 above_m(0, 0.001, test::kOrganTop_m + 0.004);
  for (std::uint64_t i = 1; i <= 200; ++i) step(1, i, above_m);
  EXPECT_EQ(operation.state(), ContactState::free);

  for (std::uint64_t i = 1; i <= 100; ++i) {
    const Vec3 tip_m = above_m - Vec3(0, 0, 6e-5 * static_cast<double>(i));
    step(2, i, tip_m);
    ASSERT_EQ(operation.simulation.tool_pose_world(0)->position_m, tip_m) << "sample " << i << " was ignored";
  }
  EXPECT_NE(operation.state(), ContactState::free) << "its tip is 2 mm beneath the skin";
}

}  // namespace
}  // namespace sectio
