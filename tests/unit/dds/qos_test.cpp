#include "common/dds/qos.h"

#include <gtest/gtest.h>

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

TEST(Qos, every_topic_travels_as_its_kind_needs) {
  const Expected table[] = {
      {qos_of<wire::ToolPacket>(), false, false, 32, 32},     {qos_of<wire::ContactModel>(), false, false, 1, 1},
      {qos_of<wire::StateHeader>(), false, false, 4, 64},     {qos_of<wire::StatePiece>(), false, false, 1024, 8192},
      {qos_of<wire::TopologyDelta>(), true, true, 256, 4096}, {qos_of<wire::KeyframeChunk>(), true, false, 256, 4096},
      {qos_of<wire::KeyframeRequest>(), true, true, 1, 256},  {qos_of<wire::SceneInfo>(), true, true, 1, 1},
      {qos_of<wire::Event>(), true, true, 16, 1024},          {qos_of<wire::SessionEnd>(), true, true, 1, 1},
      {qos_of<wire::ServerStatus>(), false, false, 1, 1},     {qos_of<wire::GravityRequest>(), true, true, 1, 1},
  };
  for (const Expected& row : table) {
    EXPECT_EQ(row.actual.reliable, row.reliable) << row.actual.name;
    EXPECT_EQ(row.actual.late_joiners, row.late_joiners) << row.actual.name;
    EXPECT_GE(row.actual.depth, row.min_depth) << row.actual.name;
    EXPECT_LE(row.actual.depth, row.max_depth) << row.actual.name;
  }
}

TEST(Qos, names_differ) {
  EXPECT_STRNE(qos_of<wire::StateHeader>().name, qos_of<wire::StatePiece>().name);
  EXPECT_STRNE(qos_of<wire::TopologyDelta>().name, qos_of<wire::KeyframeChunk>().name);
}

TEST(Qos, loss_is_noticed_and_repaired_within_a_few_frames) {
  EXPECT_LE(kHeartbeat_s, 0.02);
  EXPECT_LE(kHeartbeatResponse_s, 0.001);
  EXPECT_LE(kMaxDatagramOffHostBytes, 1400u);
  EXPECT_LE(kAnnouncement_s, 0.5);
}

}  // namespace
}  // namespace sectio
