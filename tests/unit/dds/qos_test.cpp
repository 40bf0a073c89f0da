#include "common/dds/qos.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "idl/session.h"
#include "idl/state.h"
#include "idl/tool.h"
#include "idl/topology.h"

namespace sectio {
namespace {

struct Expected {
  TopicQos actual;
  bool reliable;
  bool late_joiners;
  std::int32_t min_depth, max_depth;
};

std::vector<Expected> topics() {
  return {
      {qos_of<wire::ToolPacket>(), false, false, 32, 32},     {qos_of<wire::ContactModel>(), false, false, 1, 1},
      {qos_of<wire::StateHeader>(), false, false, 4, 64},     {qos_of<wire::StatePiece>(), false, false, 1024, 8192},
      {qos_of<wire::TopologyDelta>(), true, true, 256, 4096}, {qos_of<wire::KeyframeChunk>(), true, false, 256, 4096},
      {qos_of<wire::KeyframeRequest>(), true, true, 1, 256},  {qos_of<wire::SceneInfo>(), true, true, 1, 1},
      {qos_of<wire::Event>(), true, true, 16, 1024},          {qos_of<wire::SessionEnd>(), true, true, 1, 1},
      {qos_of<wire::ServerStatus>(), false, false, 1, 1},     {qos_of<wire::GravityRequest>(), true, true, 1, 1},
  };
}

TEST(Qos, every_topic_has_the_quality_that_its_kind_needs) {
  for (const Expected& row : topics()) {
    EXPECT_EQ(row.actual.reliable, row.reliable) << row.actual.name;
    EXPECT_EQ(row.actual.late_joiners, row.late_joiners) << row.actual.name;
    EXPECT_GE(row.actual.depth, row.min_depth) << row.actual.name;
    EXPECT_LE(row.actual.depth, row.max_depth) << row.actual.name;
  }
}

TEST(Qos, no_two_topics_share_a_name) {
  std::set<std::string> names;
  for (const Expected& row : topics()) EXPECT_TRUE(names.insert(row.actual.name).second) << row.actual.name;
  EXPECT_EQ(names.size(), 12u);
}

// A reader learns of a lost sample from the next heartbeat; its answer and the repeated sample follow.
TEST(Qos, the_periods_allow_a_repair_within_two_frames_of_a_display) {
  constexpr double kFrame_s = 1.0 / 60;
  EXPECT_LT(kHeartbeat_s + kHeartbeatResponse_s, 2 * kFrame_s);
  EXPECT_LT(kAnnouncement_s, kParticipantLease_s / 2) << "one lost announcement must not end a lease";
}

TEST(Qos, a_datagram_fits_into_one_frame_of_ethernet) {
  constexpr std::uint32_t kEthernetPayload = 1500, kIpAndUdpHeaders = 28;
  EXPECT_LE(kMaxDatagramOffHostBytes, kEthernetPayload - kIpAndUdpHeaders);
}

}  // namespace
}  // namespace sectio
