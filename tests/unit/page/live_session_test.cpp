// A page that hears messages of a gateway.
#include "render_client/page/live_session.h"

#include <gtest/gtest.h>

#include "common/messages/codec.h"
#include "common/messages/epoch.h"
#include "sim_server/world/step_io.h"

namespace sectio::page_test {
namespace {

static_assert(kCutRefused == static_cast<std::uint8_t>(EventKind::cut_refused));
static_assert(kCutEnded == static_cast<std::uint8_t>(EventKind::cut_ended));
static_assert(kReleased == static_cast<std::uint8_t>(EventKind::released));
static_assert(kBegunAnew == static_cast<std::uint8_t>(EventKind::begun_anew));
static_assert(kBodySplit == static_cast<std::uint8_t>(EventKind::body_split));
static_assert(kStepOverrun == static_cast<std::uint8_t>(EventKind::step_overrun));
static_assert(kGravityTurned == static_cast<std::uint8_t>(EventKind::gravity_turned));
static_assert(kScoreTold == static_cast<std::uint8_t>(EventKind::score_told));
static_assert(kDidNotCut == static_cast<std::uint8_t>(EventKind::did_not_cut));

struct LiveSessionTest : testing::Test {
  LiveSession session;
  Frame frame;
  double now_s = 0;

  template <class Message>
  void hear(LiveKind kind, const Message& message) {
    std::vector<std::uint8_t> bytes;
    append_live(kind, encode(message), bytes);
    session.receive(bytes, now_s);
  }
  void tell(std::uint64_t step, std::uint8_t kind, const std::string& text) {
    hear(LiveKind::event, SessionEvent{1, step, kind, 0, 0, text});
  }
  void announce(std::uint64_t epoch, const std::string& body) {
    SceneInfo scene;
    scene.epoch = epoch;
    scene.session = "theatre";
    scene.world_bodies = {"liver", "kidney"};
    scene.bodies = {{.name = body}};
    scene.tools = {{"scalpel", "scalpel"}};
    hear(LiveKind::scene, scene);
  }
  void report(std::uint64_t epoch, std::uint64_t cuts) {
    ServerStatus status;
    status.epoch = epoch;
    status.cuts_made = cuts;
    hear(LiveKind::status, status);
  }
  std::vector<std::string> texts() const {
    std::vector<std::string> all;
    for (const LiveSession::Line& line : session.lines()) all.push_back(line.text);
    return all;
  }
};

TEST_F(LiveSessionTest, holds_the_lines_of_the_score_that_was_told_last) {
  tell(5, kScoreTold, "line cut 50 %");
  tell(5, kScoreTold, "time 3 s");
  tell(6, kCutRefused, "too thin");
  EXPECT_EQ(session.score(), (std::vector<std::string>{"line cut 50 %", "time 3 s"}));
  EXPECT_EQ(texts(), std::vector<std::string>{"cut refused: too thin"});
  tell(9, kScoreTold, "line cut 90 %");
  EXPECT_EQ(session.score(), std::vector<std::string>{"line cut 90 %"});
}

TEST_F(LiveSessionTest, forgets_the_score_of_a_session_that_begins_anew) {
  announce(1, "liver");
  tell(5, kScoreTold, "line cut 50 %");
  announce(1, "liver");
  EXPECT_EQ(session.score().size(), 1);
  announce(2, "liver");
  EXPECT_TRUE(session.score().empty());
  tell(6, kScoreTold, "line cut 50 %");
  EXPECT_TRUE(session.score().empty()) << "of the term before, to whom comes late";
}

TEST_F(LiveSessionTest, says_of_which_instrument_it_tells_and_when) {
  tell(5000, kCutEnded, "it was lifted out");
  EXPECT_FALSE(session.lines().back().time_s) << "how long its steps are isn't known yet";
  announce(1, "liver");
  tell(6000, kCutEnded, "it was lifted out");
  EXPECT_EQ(session.lines().back().text, "scalpel, cut ended: it was lifted out");
  EXPECT_EQ(session.lines().back().time_s, 6.0);
}

TEST_F(LiveSessionTest, counts_what_is_told_again_in_one_line) {
  announce(1, "liver");
  tell(1000, kCutRefused, "too thin");
  for (std::uint64_t step = 2000; step < 2050; ++step)
    tell(step, kStepOverrun, "slowed: " + std::to_string(step) + " ms behind");
  tell(3000, kCutRefused, "the body is frozen");
  tell(4000, kCutRefused, "too thin");
  EXPECT_EQ(texts(),
            (std::vector<std::string>{"pace of the server slowed: 2049 ms behind",
                                      "scalpel, cut refused: the body is frozen", "scalpel, cut refused: too thin"}));
  EXPECT_EQ(session.lines()[0].count, 50U);
  EXPECT_NEAR(*session.lines()[0].time_s, 2.049, 1e-9);
  EXPECT_EQ(session.lines()[2].count, 2U);
  EXPECT_NEAR(*session.lines()[2].time_s, 4, 1e-9);
}

TEST_F(LiveSessionTest, keeps_a_status_of_each_server) {
  const std::uint64_t liver = first_epoch(10), kidney = first_epoch(20);
  announce(liver, "liver");
  announce(kidney, "kidney");
  report(kidney, 2);
  report(liver, 1);
  report(kidney, 3);
  ASSERT_EQ(session.statuses().size(), 2U);
  EXPECT_EQ(session.statuses()[0]->cuts_made, 1U) << "the liver is the first body of the scene";
  EXPECT_EQ(session.statuses()[1]->cuts_made, 3U);
}

TEST_F(LiveSessionTest, names_the_server_that_is_silent_where_there_are_several) {
  const std::uint64_t liver = first_epoch(10), kidney = first_epoch(20);
  announce(liver, "liver");
  EXPECT_FALSE(session.silence(0));
  now_s = 1;
  report(liver, 0);
  ASSERT_TRUE(session.silence(1.5));
  EXPECT_NEAR(session.silence(1.5)->for_s, 0.5, 1e-12);
  EXPECT_EQ(session.silence(1.5)->of, "") << "there is one";
  announce(kidney, "kidney");
  now_s = 2;
  report(kidney, 0);
  EXPECT_NEAR(session.silence(4)->for_s, 3, 1e-12);
  EXPECT_EQ(session.silence(4)->of, "liver");
  now_s = 4;
  report(liver, 0);
  EXPECT_NEAR(session.silence(4)->for_s, 2, 1e-12);
  EXPECT_EQ(session.silence(4)->of, "kidney");
}

TEST_F(LiveSessionTest, lets_go_of_its_instrument_with_the_connection) {
  hear(LiveKind::roster, Roster{7, {{7, "Ada", true, true}}, {3, 7}});
  EXPECT_EQ(session.held_tool(), 1U);
  session.disconnected();
  EXPECT_FALSE(session.held_tool());
  EXPECT_EQ(session.roster().holders[0], 3U) << "somebody else's";
}

}  // namespace
}  // namespace sectio::page_test
