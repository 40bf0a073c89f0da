// Several standbys of one server: one goes on when it dies, and the others stand by for that one; all of them go with a
// session that begins anew or goes back.
#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "tests/support/environment.h"
#include "tests/support/patience.h"
#include "tests/support/random.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

class Standbys : public test::SessionPrograms {
 protected:
  std::unique_ptr<Process> standby(const std::string& name, Flags more = {"--play-traces"}) const {
    more.push_back("--standby");
    auto started = one(name, more);
    EXPECT_TRUE(started->wait_for("standing by")) << started->output();
    return started;
  }
  void give(Flags order) const {
    order.insert(order.end(), {"--patience-s", "60"});
    const auto told = program("sim_server", in_session(order));
    EXPECT_EQ(told->exit_code(), 0) << told->output();
  }
  std::string status() const {
    const auto asked = program("sim_server", in_session({"status", "--patience-s", "60"}));
    EXPECT_EQ(asked->exit_code(), 0) << asked->output();
    return asked->output();
  }
  static constexpr const char* kGoesOn = "the server fell silent: this one goes on after step ";
  static constexpr const char* kNext = "it stands by for the server of a later term";
  static constexpr const char* kInStep = "it has caught up with the server";
  static bool goes_on(Process& server) { return server.wait_for(kGoesOn, std::chrono::seconds(0)); }
  // It has caught up since it said this last.
  static bool caught_up_after(const std::string& words, Process& standby) {
    do {
      const std::size_t at = standby.output().rfind(words);
      if (at != std::string::npos && standby.output().find(kInStep, at) != std::string::npos) return true;
    } while (standby.wait_for_next("\n"));
    return false;
  }
  // Kills the leader; returns the one that goes on, and the one that stays a standby.
  static std::pair<Process*, Process*> follow_after_death(Process& leader, Process& a, Process& b) {
    kill(leader);
    EXPECT_TRUE(test::wait_until([&] { return goes_on(a) || goes_on(b); })) << a.output() << b.output();
    Process &leads = goes_on(a) ? a : b, &stays = goes_on(a) ? b : a;
    EXPECT_TRUE(caught_up_after(kNext, stays)) << stays.output() << leads.output();
    EXPECT_FALSE(goes_on(stays)) << stays.output();
    return {&leads, &stays};
  }
  static void kill(Process& process) {
    process.send(SIGKILL);
    EXPECT_TRUE(process.exit_code());
  }
};

// SECTIO_DEATHS sessions, in each of which two servers die.
TEST_F(Standbys, stand_by_for_the_one_that_goes_on_so_that_its_death_is_survived_too) {
  const int sessions = static_cast<int>(test::number_from("SECTIO_DEATHS", 2));
  const std::string expected = undisturbed_hash();
  test::Random random(static_cast<unsigned>(network.domain));
  for (int i = 0; i < sessions; ++i) {
    const std::string run = std::to_string(i);
    const auto first = one("first" + run, {"--play-traces", "--wait-for-viewers", "1"});
    std::array<std::unique_ptr<Process>, 2> others;
    const std::array<std::string, 2> names{"second" + run, "third" + run};
    for (std::size_t k = 0; k < 2; ++k) others[k] = standby(names[k]);
    for (const auto& other : others) ASSERT_TRUE(other->wait_for("it hears the server")) << other->output();
    const auto screen = viewer("screen" + run, {"--no-pictures"});
    for (const auto& other : others) ASSERT_TRUE(other->wait_for("step ")) << other->output();
    let_pass(std::chrono::milliseconds(random() % 2000));
    const auto [leads, stays] = follow_after_death(*first, *others[0], *others[1]);
    if (HasFailure()) return;
    let_pass(std::chrono::milliseconds(random() % 1500));
    kill(*leads);
    ASSERT_TRUE(stays->wait_for(kGoesOn)) << stays->output();
    expect_equal_at_the_end(*screen);
    EXPECT_EQ(stays->exit_code(), 0) << stays->output();
    EXPECT_EQ(hash_of(names[stays == others[0].get() ? 0 : 1]), expected);
  }
}

TEST_F(Standbys, that_come_one_after_the_other_carry_a_session_over_many_deaths) {
  std::vector<std::unique_ptr<Process>> servers;
  servers.push_back(one("server0", {"--play-traces", "--wait-for-viewers", "1", "--endless"}));
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(servers[0]->wait_for("step ")) << servers[0]->output();
  servers.push_back(standby("server1", {"--play-traces", "--endless"}));
  Process *leader = servers[0].get(), *next = servers[1].get();
  for (int deaths = 0; deaths < 3; ++deaths) {
    servers.push_back(standby("server" + std::to_string(servers.size()), {"--play-traces", "--endless"}));
    Process* const late = servers.back().get();
    for (Process* const each : {next, late})
      ASSERT_TRUE(caught_up_after("it hears the server", *each)) << each->output();
    std::tie(leader, next) = follow_after_death(*leader, *next, *late);
    if (HasFailure()) return;
  }
  leader->send(SIGINT);
  EXPECT_TRUE(leader->exit_code()) << leader->output();
  EXPECT_TRUE(next->exit_code()) << next->output();
  EXPECT_FALSE(goes_on(*next)) << next->output();
  expect_equal_at_the_end(*screen);
  const auto number = std::ranges::find(servers, leader, &std::unique_ptr<Process>::get) - servers.begin();
  const auto again = program("sim_server", {"replay", file("server" + std::to_string(number) + "/inputs")});
  EXPECT_EQ(again->exit_code(), 0) << again->output();
  const std::string hash = json("screen.json")["bodies"][0]["topology_hash"];
  EXPECT_NE(again->output().find(hash), std::string::npos) << again->output();
}

TEST_F(Standbys, that_was_halted_while_another_one_went_on_stands_by_for_that_one) {
  const auto first = one("first", {"--play-traces", "--wait-for-viewers", "1"});
  const auto second = standby("second"), third = standby("third");
  const auto screen = viewer("screen", {"--no-pictures"});
  for (Process* const each : {second.get(), third.get()})
    ASSERT_TRUE(caught_up_after("it hears the server", *each)) << each->output();
  second->send(SIGSTOP);
  kill(*first);
  ASSERT_TRUE(third->wait_for(kGoesOn)) << third->output();
  second->send(SIGCONT);
  ASSERT_TRUE(caught_up_after(kNext, *second)) << second->output() << third->output();
  kill(*third);
  ASSERT_TRUE(second->wait_for(kGoesOn)) << second->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  EXPECT_EQ(hash_of("second"), undisturbed_hash());
}

TEST_F(Standbys, goes_with_a_session_that_begins_anew_and_goes_on_with_it) {
  const auto first = one("first", {"--play-traces", "--wait-for-viewers", "1"});
  const auto second = standby("second");
  ASSERT_TRUE(second->wait_for("it hears the server")) << second->output();
  const auto screen = viewer("screen", {"--no-pictures"});
  do ASSERT_TRUE(second->wait_for_next(" cuts")) << second->output();
  while (cuts_told_by(*second) == 0);
  give({"anew"});
  ASSERT_TRUE(second->wait_for(": this one goes back to step 0")) << second->output();
  ASSERT_TRUE(caught_up_after("goes back", *second)) << second->output();
  kill(*first);
  ASSERT_TRUE(second->wait_for(kGoesOn)) << second->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  EXPECT_EQ(hash_of("second/try_2"), undisturbed_hash());
  EXPECT_GT(json("second/report.json")["bodies"][0]["revision"], 0) << "the first try";
}

// Hands are alive here: a motion is never the same twice.
TEST_F(Standbys, goes_back_with_its_server_and_ends_with_the_same_bodies) {
  const auto first = one("first", {"--endless"});
  const auto second = standby("second", {"--endless"});
  ASSERT_TRUE(second->wait_for("it hears the server")) << second->output();
  const auto hand = bridge();
  ASSERT_TRUE(hand->wait_for("4.0 s, force")) << hand->output();
  give({"seek", "--to-s", "2.5"});
  ASSERT_TRUE(second->wait_for(": this one goes back to step ")) << second->output();
  ASSERT_TRUE(caught_up_after("goes back", *second)) << second->output();
  EXPECT_EQ(second->output().find("goes back to step 0\n"), std::string::npos) << second->output();
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  first->send(SIGINT);
  EXPECT_TRUE(first->exit_code());
  EXPECT_TRUE(second->exit_code());
  EXPECT_FALSE(goes_on(*second)) << second->output();
  EXPECT_EQ(hash_of("second/try_2"), hash_of("first/try_2"));
  EXPECT_EQ(json("second/try_2/report.json")["run"]["steps"], json("first/try_2/report.json")["run"]["steps"]);
}

TEST_F(Standbys, that_come_into_a_pause_know_the_speed_at_which_the_session_goes_on) {
  const auto first = one("first", {"--endless"});
  ASSERT_TRUE(first->wait_for("step ")) << first->output();
  give({"speed", "--factor", "0.25"});
  give({"freeze", "--tool-id", "0"});
  give({"pause"});
  const auto second = standby("second", {"--endless"});
  ASSERT_TRUE(second->wait_for(kInStep)) << second->output();
  kill(*first);
  ASSERT_TRUE(second->wait_for(kGoesOn)) << second->output();
  EXPECT_NE(status().find("tool 0 is frozen"), std::string::npos);
  give({"go-on"});
  const std::string goes_on = status();
  EXPECT_NE(goes_on.find("at 0.25 times the clock"), std::string::npos) << goes_on;
}

}  // namespace
}  // namespace sectio
