#include "sim_server/net/sample_deduplicator.h"

#include <gtest/gtest.h>

#include "tests/support/operation.h"

namespace sectio::net_test {
namespace {

ToolPacket packet_of(std::uint64_t source, std::initializer_list<std::uint64_t> sequences) {
  ToolPacket packet{source, 0, {}};
  for (const std::uint64_t sequence : sequences) packet.samples.push_back({0, sequence, 0, {}});
  return packet;
}

TEST(SampleDeduplicator, passes_each_pose_once_and_in_order_though_packets_repeat_and_get_lost) {
  SampleDeduplicator deduplicator(1);
  std::vector<ToolSample> samples;
  deduplicator.accept(packet_of(1, {1}), 0, samples);
  deduplicator.accept(packet_of(1, {1, 2}), 0, samples);
  deduplicator.accept(packet_of(1, {2, 3, 4, 5}), 0, samples);  // two packets were lost, no pose
  deduplicator.accept(packet_of(1, {2, 3, 4}), 0, samples);     // late
  deduplicator.accept(packet_of(1, {8, 9}), 0, samples);
  std::vector<std::uint64_t> sequences;
  for (const ToolSample& sample : samples) sequences.push_back(sample.sequence);
  EXPECT_EQ(sequences, (std::vector<std::uint64_t>{1, 2, 3, 4, 5, 8, 9}));
  EXPECT_EQ(deduplicator.lost(), 2u);
}

// The result doesn't depend on the clocks from which the sources are made.
TEST(SampleDeduplicator, hears_who_has_begun_until_he_falls_silent) {
  for (const auto& [first, second] : {std::pair(1u, 2u), std::pair(2u, 1u)}) {
    SampleDeduplicator deduplicator(1);
    std::vector<ToolSample> samples;
    EXPECT_TRUE(deduplicator.accept(packet_of(first, {100}), 0, samples));
    EXPECT_FALSE(deduplicator.accept(packet_of(second, {1}), 0.5 * Speaker::kSilence_s, samples));
    EXPECT_TRUE(deduplicator.accept(packet_of(second, {2}), 1.1 * Speaker::kSilence_s, samples));
    EXPECT_FALSE(deduplicator.accept(packet_of(first, {101}), 1.2 * Speaker::kSilence_s, samples)) << "it woke up";
    ASSERT_EQ(samples.size(), 2u);
    EXPECT_EQ(samples[0].source, first);
    EXPECT_EQ(samples[1].source, second);
    EXPECT_EQ(deduplicator.refused(), 2u);
    ToolPacket unknown = packet_of(second, {3});
    unknown.tool_id = 1;
    EXPECT_FALSE(deduplicator.accept(unknown, 1, samples));
    EXPECT_EQ(deduplicator.refused(), 3u);
  }
}

TEST(SampleDeduplicator, says_once_that_nobody_speaks_for_a_tool_any_more) {
  constexpr double kLong_s = SampleDeduplicator::kSilence_s + 0.1;
  SampleDeduplicator deduplicator(2);
  std::vector<ToolSample> samples;
  EXPECT_TRUE(deduplicator.take_silent(100).empty()) << "nobody has ever spoken";
  deduplicator.accept(packet_of(1, {1}), 100, samples);
  EXPECT_TRUE(deduplicator.take_silent(100.5).empty());
  EXPECT_EQ(deduplicator.take_silent(100 + kLong_s), (std::vector<std::uint32_t>{0}));
  EXPECT_TRUE(deduplicator.take_silent(100 + kLong_s).empty());
  deduplicator.accept(packet_of(1, {2}), 103, samples);
  EXPECT_EQ(deduplicator.take_silent(103 + kLong_s), (std::vector<std::uint32_t>{0}));
}

TEST(SampleDeduplicator, says_that_nobody_speaks_for_a_tool_that_is_in_the_scene) {
  constexpr double kLong_s = SampleDeduplicator::kSilence_s + 0.1;
  SampleDeduplicator deduplicator(3);
  std::vector<ToolSample> samples;
  for (const std::uint32_t tool : {0u, 1u}) deduplicator.expect(tool, 100);
  EXPECT_TRUE(deduplicator.take_silent(100.5).empty());
  deduplicator.accept(packet_of(1, {1}), 100.9, samples);
  EXPECT_EQ(deduplicator.take_silent(100 + kLong_s), (std::vector<std::uint32_t>{1})) << "somebody moves tool 0";
  EXPECT_EQ(deduplicator.take_silent(100.9 + kLong_s), (std::vector<std::uint32_t>{0}));
  EXPECT_TRUE(deduplicator.take_silent(110).empty());
}

// A bridge with the scalpel at rest, then another one that moves it: what the simulation makes of both.
TEST(RestartedBridge, moves_its_instrument_from_its_first_sample_on) {
  test::Operation operation(test::organ_scene());
  SampleDeduplicator deduplicator(1);
  double now_s = 0;
  const auto step = [&](std::uint64_t source, std::uint64_t sequence, const Vec3& tip_m) {
    const ToolSample sample{
        0, sequence, static_cast<double>(sequence) * 0.001, {tip_m, Eigen::Quaterniond::Identity()}};
    StepInput input;
    deduplicator.accept({source, 0, {sample}}, now_s, input.samples);
    now_s += 0.001;
    operation.step(input);
  };
  const Vec3 above_m(0, 0.001, test::kOrganTop_m + 0.004);
  for (std::uint64_t i = 1; i <= 200; ++i) step(1, i, above_m);
  EXPECT_EQ(operation.state(), ContactState::free);

  now_s += 2 * Speaker::kSilence_s;
  for (std::uint64_t i = 1; i <= 100; ++i) {
    const Vec3 tip_m = above_m - Vec3(0, 0, 6e-5 * static_cast<double>(i));
    step(2, i, tip_m);
    ASSERT_EQ(operation.simulation.tool_pose_world(0)->position_m, tip_m) << "sample " << i << " was ignored";
  }
  EXPECT_NE(operation.state(), ContactState::free) << "its tip is 2 mm beneath the skin";
}

}  // namespace
}  // namespace sectio::net_test
