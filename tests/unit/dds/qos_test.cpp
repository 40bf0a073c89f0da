#include "common/dds/qos.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "common/dds/announcement.h"
#include "common/dds/participant.h"
#include "tests/unit/dds/messages.h"

namespace sectio::dds_test {
namespace {

struct Expected {
  TopicQos actual;
  bool reliable;
  bool late_joiners;
  std::int32_t min_depth, max_depth;
};

TEST(Qos, every_topic_travels_as_its_kind_needs) {
  const Expected table[] = {
      {qos_of<ToolPacket>(), false, false, 32, 32},     {qos_of<ContactMessage>(), false, false, 1, 1},
      {qos_of<StateHeader>(), true, false, 4, 16},      {qos_of<StatePiece>(), true, false, 64, 256},
      {qos_of<DeltaMessage>(), true, false, 256, 4096}, {qos_of<KeyframeChunk>(), true, false, 256, 4096},
      {qos_of<KeyframeRequest>(), true, true, 1, 256},  {qos_of<SceneInfo>(), true, true, 1, 1},
      {qos_of<SessionEvent>(), true, true, 16, 1024},   {qos_of<SessionEnd>(), true, true, 1, 1},
      {qos_of<ServerStatus>(), false, false, 1, 1},     {qos_of<SessionOrder>(), true, false, 1, 16},
      {qos_of<ScalarPiece>(), true, false, 64, 256},    {qos_of<ToolWish>(), false, false, 1, 32},
      {qos_of<LinkReport>(), false, false, 1, 16}};
  for (const Expected& row : table) {
    EXPECT_EQ(row.actual.reliable, row.reliable) << row.actual.name;
    EXPECT_EQ(row.actual.late_joiners, row.late_joiners) << row.actual.name;
    EXPECT_GE(row.actual.depth, row.min_depth) << row.actual.name;
    EXPECT_LE(row.actual.depth, row.max_depth) << row.actual.name;
  }
}

// A reader learns of a lost sample from the next heartbeat; its answer and the repeated sample follow.
TEST(Qos, the_periods_allow_a_repair_within_two_frames_of_a_display) {
  constexpr double kFrame_s = 1.0 / 60;
  EXPECT_LT(kStream.heartbeat_s + kStream.response_s + kStream.nack_response_s, 2 * kFrame_s);
  for (const Lease& lease : {kLeaseOnHost, kLeaseOffHost})
    EXPECT_LT(lease.announcement_s, lease.duration_s / 2) << "one lost announcement must not end a lease";
}

TEST(Qos, a_datagram_fits_into_one_frame_of_ethernet) {
  constexpr std::uint32_t kEthernetPayload = 1500, kIpAndUdpHeaders = 28;
  EXPECT_LE(kMaxDatagramOffHostBytes, kEthernetPayload - kIpAndUdpHeaders);
}

TEST(Qos, every_message_has_a_topic_of_its_own_and_its_largest_example_fits) {
  std::set<std::string> names, types;
  test::for_each_message([&](const auto& message) {
    const TopicQos& topic = qos_of<std::decay_t<decltype(message)>>();
    names.insert(topic.name);
    types.insert(topic.type);
  });
  EXPECT_EQ(names.size(), std::size_t{test::kMessages});
  EXPECT_EQ(types.size(), std::size_t{test::kMessages});
  EXPECT_EQ(topics().size(), std::size_t{test::kMessages});
}

// docs/wire.md has a row for each topic.
TEST(Qos, the_table_of_topics_in_the_documents_is_true) {
  std::ifstream file(SECTIO_SOURCE_DIR "/docs/wire.md");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  for (const TopicQos& topic : topics()) {
    const std::string type = topic.type;
    const std::string row = "| `" + std::string(topic.name) + "` | `" + type.substr(type.rfind(':') + 1) + "` | " +
                            (topic.reliable ? "reliable" : "best effort") + " | " +
                            (topic.reliable ? "transient local" : "volatile") + " | " + std::to_string(topic.depth) +
                            " | " + std::to_string(topic.max_bytes) + " |";
    EXPECT_NE(text.find(row), std::string::npos) << row;
  }
  EXPECT_NE(text.find("`" + partition_of({0, "theatre", {}, {}}) + "`"), std::string::npos);
  EXPECT_NE(text.find("`" + to_user_data({kProtocolVersion, "theatre"}) + "`"), std::string::npos);
}

TEST(Announcement, comes_back_and_is_not_taken_for_that_of_another_program) {
  const Announcement announcement{3, "theatre"};
  EXPECT_EQ(announcement_from(to_user_data(announcement)), announcement);
  EXPECT_EQ(announcement_from(to_user_data({2, ""}))->session, "");
  for (const char* other : {"", "sectio", "sectio protocol=", "sectio protocol=x session=a", "sectio protocol=2",
                            "sectio protocol=99999999999999 session=a", "sectio protocol=2 session=a\nb", "ros2"})
    EXPECT_FALSE(announcement_from(other)) << other;
}

}  // namespace
}  // namespace sectio::dds_test
