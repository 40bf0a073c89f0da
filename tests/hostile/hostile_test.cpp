// A session goes on as if nobody had spoken, whatever a program that means ill says: the server cuts what the hand
// cuts, every viewer ends with the server's hash, and the hand feels no push.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <sstream>

#include "common/math/types.h"
#include "tests/support/patience.h"
#include "tests/support/session_programs.h"

namespace sectio::test {
namespace {

constexpr double kMostSlew_n_per_s = 500 + 700 * 0.06;  // and the hand's own way, 60 mm/s, through the stiffest spring

struct Tick {
  double time_s = 0;
  Vec3 force_n = Vec3::Zero();
  double age_s = 0;
  bool silent = false;
};

class Hostile : public SessionPrograms, public testing::WithParamInterface<const char*> {
 protected:
  std::vector<Tick> ticks() const {
    std::ifstream log(file("force.csv"));
    std::string line, cell;
    std::getline(log, line);
    std::vector<Tick> all;
    while (std::getline(log, line)) {
      std::istringstream cells(line);
      std::vector<std::string> row;
      while (std::getline(cells, cell, ',')) row.push_back(cell);
      if (row.size() < 15) continue;
      const auto number = [&](std::size_t i) { return std::stod(row[i]); };
      all.push_back({number(0), Vec3(number(9), number(10), number(11)), number(12), number(14) != 0});
    }
    return all;
  }
  static std::size_t peak_bytes(const Process& process) {
    std::ifstream status("/proc/" + std::to_string(process.id()) + "/status");
    std::string word;
    while (status >> word)
      if (word == "VmHWM:") return status >> word, std::stoull(word) * 1024;
    return 0;
  }
};

class HostileToStandby : public SessionPrograms, public testing::WithParamInterface<const char*> {};

// The standby is undisturbed, too: it follows when the server dies.
TEST_P(HostileToStandby, a_standby_follows_its_server_and_no_stranger) {
  const auto first = program("sim_server", in_session({"--scene", kScene, "--play-traces", "--steps", "15000",
                                                       "--wait-for-viewers", "1", "--export", file("first")}));
  const auto second = program("sim_server", in_session({"--scene", kScene, "--play-traces", "--steps", "15000",
                                                        "--standby", "--export", file("second")}));
  ASSERT_TRUE(second->wait_for("it hears the server")) << second->output();
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(has_simulated(*first, 1)) << first->output();
  const auto hostile = program("hostile", {GetParam(), network.session, std::to_string(network.domain)});
  EXPECT_EQ(hostile->exit_code(), 0) << hostile->output();
  const auto third = program("sim_server", in_session({"--scene", kScene, "--play-traces", "--steps", "15000",
                                                       "--standby", "--export", file("third")}));
  EXPECT_TRUE(third->wait_for("it has caught up with the server")) << third->output();
  third->send(SIGKILL);
  EXPECT_EQ(second->output().find("fell silent"), std::string::npos) << second->output();
  first->send(SIGKILL);
  EXPECT_TRUE(second->wait_for("this one goes on after step ")) << second->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(second->exit_code(), 0) << second->output();
  EXPECT_EQ(hash_of("second"), undisturbed_hash());
}

class HostileLeader : public Hostile {
 protected:
  std::string give(Flags order) const {
    order.insert(order.end(), {"--patience-s", "30"});
    const auto leader = program("sim_server", in_session(order));
    EXPECT_EQ(leader->exit_code(), 0) << leader->output();
    return leader->output();
  }
};

TEST_F(HostileLeader, a_flood_of_orders_starves_no_hand_and_keeps_no_leader_from_being_obeyed) {
  auto sim = server({"--endless", "--export", file("out")});
  const auto screen = viewer("screen", {"--no-pictures"});
  const auto hand =
      program("device_bridge", in_session({"--trace", kTrace, "--wait-for-server", "--log", file("force.csv")}));
  ASSERT_TRUE(has_simulated(*sim, 1)) << sim->output();
  const auto hostile = program("hostile", {"session_orders", network.session, std::to_string(network.domain)});
  ASSERT_TRUE(hostile->wait_for("it begins")) << hostile->output();
  EXPECT_NE(give({"speed", "--factor", "0.9"}).find("1 server obeys"), std::string::npos);
  EXPECT_EQ(hostile->exit_code(), 0) << hostile->output();
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  give({"pause"});
  std::string status;
  EXPECT_TRUE(wait_until([&] {  // an event comes after the flood that it tells of
    status = give({"status"});
    return status.find("refused last: orders came too fast: ") != std::string::npos;
  })) << status;
  EXPECT_NE(status.find("s simulated, paused"), std::string::npos) << status;
  give({"go-on"});
  sim->send(SIGINT);
  EXPECT_TRUE(sim->exit_code()) << sim->output();
  expect_equal_at_the_end(*screen);
  EXPECT_NE(sim->output().find("gives orders too fast"), std::string::npos) << sim->output();
  std::uint64_t tries = 1, refused = 0;
  for (; std::filesystem::exists(file("out/try_" + std::to_string(tries + 1))); ++tries) continue;
  refused = json("out/try_" + std::to_string(tries) + "/report.json")["session_cost"]["orders_refused"];
  EXPECT_LE(tries, 4u) << "orders to go somewhere that come at once are one";
  EXPECT_GT(refused, 1000u);
  const std::vector<Tick> felt = ticks();
  const auto deaf = std::ranges::count_if(felt, [](const Tick& tick) { return tick.age_s > 0.1; });
  EXPECT_LT(deaf, std::ssize(felt) / 5) << "the hand feels the tissue while the flood runs";
  std::printf("%llu tries, %llu orders refused, the hand was without a model in %td of %td ticks\n",
              static_cast<unsigned long long>(tries), static_cast<unsigned long long>(refused), deaf, std::ssize(felt));
}

class HostileToLatecomers : public SessionPrograms {};

TEST_P(Hostile, a_session_goes_on_as_if_nobody_had_spoken) {
  auto sim = server({"--steps", "6000", "--export", file("out")});
  auto screen = viewer("screen", {"--no-pictures"});
  auto hand =
      program("device_bridge", in_session({"--trace", kTrace, "--wait-for-server", "--log", file("force.csv")}));
  ASSERT_TRUE(has_simulated(*sim, 1)) << sim->output();
  const auto hostile = program("hostile", {GetParam(), network.session, std::to_string(network.domain)});
  EXPECT_EQ(hostile->exit_code(), 0) << hostile->output();
  EXPECT_LT(peak_bytes(*screen), std::size_t{400} << 20);
  EXPECT_LT(peak_bytes(*sim), std::size_t{400} << 20);

  expect_equal_at_the_end(*screen);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  const nlohmann::json report = json("out/report.json");
  EXPECT_EQ(report["run"]["steps"], 6000);
  EXPECT_EQ(report["run"]["events"]["penetrated"], 1) << "nobody else moved the scalpel";
  EXPECT_EQ(report["outcome"]["incisions"], 1);
  EXPECT_GT(json("screen.json")["states_drawn"], 60);

  const std::vector<Tick> felt = ticks();
  ASSERT_GT(felt.size(), 3000u);
  double steepest_n_per_s = 0, most_n = 0;
  for (std::size_t i = 1; i < felt.size(); ++i) {
    const double dt_s = std::max(1e-3, felt[i].time_s - felt[i - 1].time_s);
    steepest_n_per_s = std::max(steepest_n_per_s, (felt[i].force_n - felt[i - 1].force_n).norm() / dt_s);
    most_n = std::max(most_n, felt[i].force_n.norm());
  }
  EXPECT_LE(steepest_n_per_s, kMostSlew_n_per_s);
  EXPECT_LT(most_n, 9.5) << "the tissue alone pushes with less";
  const auto silent = std::count_if(felt.begin(), felt.end(), [](const Tick& tick) { return tick.silent; });
  EXPECT_LT(silent, static_cast<long>(felt.size() / 10)) << "the hand was not lost";
}

// They hear the server's scene and the stranger's at once, in any order.
TEST_F(HostileToLatecomers, those_who_come_late_hear_the_server) {
  auto sim = server({"--steps", "8000"});
  const auto there = viewer("there", {"--no-pictures"});
  const auto hand = bridge();
  ASSERT_TRUE(has_simulated(*sim, 1)) << sim->output();
  const auto hostile = program("hostile", {"scene_for_latecomers", network.session, std::to_string(network.domain)});
  ASSERT_TRUE(hostile->wait_for("it stays")) << hostile->output();
  std::vector<std::unique_ptr<Process>> late;
  for (const char* name : {"a", "b", "c", "d"}) late.push_back(viewer(name, {"--no-pictures"}));
  expect_equal_at_the_end(*there);
  for (const auto& viewer : late) expect_equal_at_the_end(*viewer);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
}

INSTANTIATE_TEST_SUITE_P(Attacks, Hostile,
                         testing::Values("tool_packets", "scenes", "session_end", "state_headers", "contact_models",
                                         "large_messages", "damaged_packets", "later_term", "step_inputs",
                                         "step_requests", "keyframe_requests", "link_reports", "tool_wishes", "events"),
                         [](const auto& attack) { return std::string(attack.param); });

INSTANTIATE_TEST_SUITE_P(Attacks, HostileToStandby,
                         testing::Values("later_term", "step_inputs", "step_requests", "session_end"),
                         [](const auto& attack) { return std::string(attack.param); });

}  // namespace
}  // namespace sectio::test
