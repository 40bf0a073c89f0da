#include "sim_server/session/blade_watch.h"

#include <gtest/gtest.h>

namespace sectio::session_test {
namespace {

struct Watched {
  Scene scene;
  std::vector<std::string> warnings, at_end;

  explicit Watched(const std::string& kind) {
    scene.step_s = 0.1;
    scene.bodies.emplace_back().name = "liver";
    scene.bodies[0].cutting.threshold_force_n = 0.5;
    ToolSpec& tool = scene.tools.emplace_back();
    tool.name = "tool";
    tool.kind = kind;
    tool.geometry = instrument_of(kind).geometry;
  }

  // So many seconds of contact, with what happens in the first step.
  void touch(double time_s, double force_n, const std::vector<Event>& events = {}) {
    BladeWatch watch(scene);
    StepOutput output;
    output.events = {{0, EventKind::contact_began, 0, 0, ""}};
    output.events.insert(output.events.end(), events.begin(), events.end());
    output.contacts.resize(1);
    output.contacts[0].state = ContactState::contact;
    output.contacts[0].force_world_n = Vec3(0, 0, force_n);
    for (int k = 0; k < time_s / scene.step_s; ++k) {
      for (std::string& text : watch.add(output)) warnings.push_back(std::move(text));
      output.events.clear();
    }
    at_end = watch.finish();
  }
};

TEST(BladeWatch, a_blade_that_pushes_too_lightly_is_named_once) {
  Watched w("scalpel");
  w.touch(5, 0.2);
  EXPECT_EQ(w.warnings, std::vector<std::string>{"tool tool has touched tissue for 2 s without cutting: it pushed with "
                                                 "0.2 N at most, and threshold_force_n is 0.5 N in liver"});
  EXPECT_TRUE(w.at_end.empty());
}

TEST(BladeWatch, a_short_touch_that_pushes_too_lightly_is_named_at_the_end) {
  Watched w("scalpel");
  w.touch(0.5, 0.2);
  EXPECT_TRUE(w.warnings.empty());
  EXPECT_EQ(w.at_end, std::vector<std::string>{"tool tool has touched tissue for 0.5 s without cutting: it pushed with "
                                               "0.2 N at most, and threshold_force_n is 0.5 N in liver"});
}

TEST(BladeWatch, a_push_that_was_too_short_counts_as_too_light) {
  Watched w("scalpel");
  w.scene.step_s = 0.001;
  BladeWatch watch(w.scene);
  StepOutput output;
  output.contacts.resize(1);
  output.contacts[0].state = ContactState::contact;
  for (int k = 0; k < 2100; ++k) {
    output.contacts[0].force_world_n = Vec3(0, 0, k == 100 ? 0.6 : 0.2);
    for (std::string& text : watch.add(output)) w.warnings.push_back(std::move(text));
  }
  EXPECT_EQ(w.warnings, std::vector<std::string>{"tool tool has touched tissue for 2 s without cutting: it pushed with "
                                                 "0.28 N at most, and threshold_force_n is 0.5 N in liver"});
}

TEST(BladeWatch, the_reason_of_refused_cuts_is_given) {
  Watched w("scalpel");
  w.touch(3, 2, {{0, EventKind::cut_refused, 0, 0, "no entry"}});
  ASSERT_EQ(w.warnings.size(), 1u);
  EXPECT_NE(w.warnings[0].find("every cut was refused: no entry"), std::string::npos) << w.warnings[0];
}

TEST(BladeWatch, a_remark_says_why_a_blade_did_not_cut) {
  Watched w("scalpel");
  w.touch(3, 2, {{0, EventKind::did_not_cut, 0, 0, "its tip is outside"}});
  EXPECT_EQ(w.warnings,
            std::vector<std::string>{"tool tool has touched tissue for 2 s without cutting: its tip is outside"});
}

TEST(BladeWatch, one_that_cuts_touches_shortly_or_has_no_edge_is_not_named) {
  Watched cuts("scalpel"), short_touch("scalpel"), probe("probe");
  cuts.touch(5, 2, {{0, EventKind::penetrated, 0, 0, ""}});
  short_touch.touch(0.2, 0.2);
  probe.touch(5, 0.2);
  for (const Watched* w : {&cuts, &short_touch, &probe}) {
    EXPECT_TRUE(w->warnings.empty());
    EXPECT_TRUE(w->at_end.empty());
  }
}

}  // namespace
}  // namespace sectio::session_test
