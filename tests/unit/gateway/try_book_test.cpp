// The gateway's memory of tries: what was told and seen is what a page gets, also in a later session.
#include "render_client/gateway/try_book.h"

#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>

#include "render_client/gateway/gateway.h"

namespace sectio::gateway_test {
namespace {

struct TryBookTest : testing::Test {
  std::string directory = testing::TempDir() + "sectio_tries_" + std::to_string(getpid());

  ~TryBookTest() override { std::filesystem::remove_all(directory); }

  static void tell(TryBook& book, std::uint64_t epoch, std::uint8_t kind, const std::string& text) {
    book.feed(SessionEvent{epoch, 5, kind, 0, 0, text});
  }
  static SceneInfo scene_of(std::uint64_t epoch, const std::string& task) {
    SceneInfo scene;
    scene.epoch = epoch;
    scene.tools = {{"scalpel", "scalpel"}};
    scene.task = {task};
    return scene;
  }
  // A try of 1 s in which the scalpel goes 10 mm along x, with a force of 2 N in the middle.
  static void make_try(TryBook& book, std::uint64_t epoch, const std::string& task, const std::string& score,
                       double from_s = 0) {
    book.feed(scene_of(epoch, task));
    for (int i = 0; i <= 60; ++i) {
      press(book, epoch, i == 30 ? 2 : 0.5);
      see(book, epoch, from_s + i / 60.0, 0.01 * (from_s + i / 60.0));
    }
    tell(book, epoch, kScoreTold, score);
    book.tick({"Ada"});
  }
  static void press(TryBook& book, std::uint64_t epoch, double force_n) {
    ContactMessage contact;
    contact.epoch = epoch;
    contact.model.force_world_n = Vec3(0, 0, force_n);
    book.feed(contact);
  }
  static void see(TryBook& book, std::uint64_t epoch, double sim_time_s, double x_m) {
    StateHeader state;
    state.epoch = epoch;
    state.sim_time_s = sim_time_s;
    state.tools = {{true, Pose{Vec3(x_m, 0, 0)}}};
    book.feed(state);
  }
  static std::size_t count(const std::string& text, const std::string& part) {
    std::size_t n = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
    return n;
  }
};

TEST_F(TryBookTest, a_try_has_its_score_path_and_force_and_stays_for_later_sessions) {
  {
    TryBook book;
    book.keep_in(directory);
    make_try(book, 1, "cut along the line", "line cut   50 %");
    book.feed(scene_of(2, "cut along the line"));
    tell(book, 2, kBegunAnew, "the session begins anew");
    book.tick({});
    make_try(book, 2, "cut along the line", "line cut   90 %");
    tell(book, 2, kScoreTold, "time   3 s");
    book.tick({});
    EXPECT_EQ(count(book.json(), "begun_s"), 2u);
  }
  TryBook later;
  later.keep_in(directory);
  EXPECT_EQ(later.json(), "[]") << "nobody has said which exercise it is";
  later.feed(scene_of(3, "cut along the line"));
  const std::string all = later.json();
  EXPECT_LT(all.find("50 %"), all.find(R"("line cut   90 %","time   3 s")")) << all;
  EXPECT_EQ(count(all, R"("hands":["Ada"])"), 2u);
  EXPECT_NE(all.find("[0,0,0],[1"), std::string::npos) << all;
  EXPECT_NE(all.find("0.5,2,0.5"), std::string::npos) << all;
  later.feed(scene_of(4, "another exercise"));
  EXPECT_EQ(later.json(), "[]");
}

TEST_F(TryBookTest, another_exercise_has_its_own_instruments) {
  TryBook book;
  book.feed(scene_of(1, "cut along the line"));
  SceneInfo other = scene_of(2, "take out the tumour");
  other.tools = {{"knife", "scalpel"}, {"forceps", "forceps"}};
  book.feed(other);
  press(book, 2, 1);
  see(book, 2, 0, 0);
  tell(book, 2, kScoreTold, "taken   1");
  book.tick({"Ada"});
  const std::string tries = book.json();
  EXPECT_EQ(count(tries, "\"scalpel\""), 0u) << tries;
  for (const char* tool : {"\"knife\"", "\"forceps\""}) EXPECT_EQ(count(tries, tool), 1u) << tries;
}

TEST_F(TryBookTest, a_session_that_goes_back_in_time_goes_on_with_its_try) {
  TryBook book;
  book.keep_in(directory);
  make_try(book, 1, "cut along the line", "line cut   50 %");
  make_try(book, 2, "cut along the line", "line cut   60 %", 1);
  see(book, 3, 1.5, 0);
  book.feed(scene_of(3, "cut along the line"));
  see(book, 3, 1.5, 0.015);  // back from 2 s
  tell(book, 3, kScoreTold, "line cut   70 %");
  book.tick({});
  const std::string tries = book.json();
  EXPECT_EQ(count(tries, "begun_s"), 1u) << tries;
  EXPECT_NE(tries.find(R"("score":["line cut   70 %"],"hands":["Ada"])"), std::string::npos) << tries;
  EXPECT_NE(tries.find("[14.3,0,0],[15,0,0]]"), std::string::npos) << "all that came before it, and no more: " << tries;
}

// The score of the try before comes when the session has begun anew already.
TEST_F(TryBookTest, a_session_that_begins_anew_has_kept_its_try_and_begins_one_in_which_nothing_was_touched) {
  TryBook book;
  book.keep_in(directory);
  make_try(book, 1, "cut along the line", "line cut   50 %");
  press(book, 1, 1);
  book.feed(scene_of(2, "cut along the line"));
  see(book, 2, 0, 0);
  tell(book, 1, kScoreTold, "line cut   60 %");
  tell(book, 2, kBegunAnew, "the session begins anew");
  book.tick({});
  EXPECT_NE(book.json().find("60 %"), std::string::npos) << book.json();
  see(book, 2, 1, 0);
  tell(book, 2, kScoreTold, "line cut   0 %");
  book.tick({"Ada"});
  EXPECT_EQ(count(book.json(), "begun_s"), 1u) << book.json();
}

TEST_F(TryBookTest, a_try_in_which_nothing_was_touched_is_none) {
  TryBook book;
  book.keep_in(directory);
  book.feed(scene_of(1, "cut along the line"));
  see(book, 1, 0, 0);
  tell(book, 1, kScoreTold, "line cut   0 %");
  book.tick({"Ada"});
  EXPECT_EQ(book.json(), "[]");
  press(book, 1, 0.1);
  see(book, 1, 1, 0);
  tell(book, 1, kScoreTold, "line cut   0 %");
  book.tick({"Ada"});
  EXPECT_EQ(count(book.json(), "begun_s"), 1u);
}

TEST_F(TryBookTest, a_long_try_is_kept_more_coarsely) {
  TryBook book;
  book.feed(scene_of(1, "wait"));
  for (int i = 0; i < 20000; ++i) {
    press(book, 1, 0.5);
    see(book, 1, 0.1 * i, 0);
  }
  tell(book, 1, kScoreTold, "time");
  EXPECT_LT(book.json().size(), 100000u);
  EXPECT_EQ(book.json().find("\"every_s\":0.1,"), std::string::npos);
}

// The task doesn't go under in other events.
TEST_F(TryBookTest, who_comes_late_is_told_the_task) {
  Gateway gateway({"secret", ""}, {}, 7);
  gateway.feed(scene_of(1, "cut along the line"));
  for (std::uint64_t i = 0; i < 100; ++i) gateway.feed(SessionEvent{1, i, 0, 0, 0, "something else"});
  const std::uint32_t late = gateway.connect().value();
  std::string heard;
  for (std::vector<std::uint8_t> frame; gateway.next_frame(late, frame);) heard.append(frame.begin(), frame.end());
  EXPECT_EQ(count(heard, "cut along the line"), 1u);
}

}  // namespace
}  // namespace sectio::gateway_test
