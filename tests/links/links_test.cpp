// Whole sessions behind bad links. On a machine that lets nobody make network namespaces, one line says so.
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/linked_session.h"
#include "tests/support/process.h"

namespace sectio::test {
namespace {

class Links : public testing::Test {
 protected:
  void SetUp() override {
    try {
      VirtualNetwork({{}, {}});
    } catch (const std::exception& error) {
      GTEST_SKIP() << "needs network namespaces: " << error.what();
    }
  }
  SessionFigures session(LinkedSession s) {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    const auto directory =
        std::filesystem::path(testing::TempDir()) / ("sectio_" + name + "_" + std::to_string(getpid()));
    const SessionFigures figures = run(s, directory);
    std::error_code ignored;
    std::filesystem::remove_all(directory, ignored);
    EXPECT_EQ(figures.trouble, "");
    return figures;
  }
};

constexpr double kMbit = 1e6;

HostLinks behind(double mbit_per_s) {
  return {.down = {.rate_bit_per_s = mbit_per_s * kMbit}};
}

// The margins are wide, for machines that have more to do; link_chart prints the figures.
TEST_F(Links, D_4_a_viewer_behind_lost_and_delayed_packets_sees_the_session_and_ends_with_the_servers_hash) {
  const SessionFigures figures = session({.viewers = {{.down = {.delay_s = 0.005, .jitter_s = 0.002, .loss = 0.05}}}});
  EXPECT_EQ(figures.viewers[0].equals_server, "yes");
  EXPECT_GT(figures.viewers[0].states, 40);
}

TEST_F(Links, D_4_states_that_others_have_overtaken_are_drawn) {
  const SessionFigures figures =
      session({.viewers = {{.down = {.delay_s = 0.025, .jitter_s = 0.010, .reorders = true}}}});
  EXPECT_EQ(figures.viewers[0].equals_server, "yes");
  EXPECT_GT(figures.viewers[0].states, 60) << "a best-effort reader draws 34";
}

TEST_F(Links, D_10_a_viewer_behind_a_thin_link_is_given_what_fits) {
  const SessionFigures figures = session({.viewers = {behind(5)}});
  EXPECT_EQ(figures.viewers[0].equals_server, "yes");
  EXPECT_GT(figures.viewers[0].states, 15);
  EXPECT_LT(figures.offered.bytes, 40'000'000u) << "repeats of what waits in a queue were 400 MB";
}

// A state of 155 000 triangles is larger than the queue of the link.
TEST_F(Links, D_10_a_large_body_is_seen_through_a_link_whose_queue_is_smaller_than_a_state) {
  const SessionFigures figures = session({.finer = 2, .duration_s = 2, .viewers = {behind(50)}});
  EXPECT_EQ(figures.viewers[0].equals_server, "yes");
  EXPECT_GT(figures.viewers[0].states, 2) << "0 when each state was one burst";
}

TEST_F(Links, D_10_a_viewer_behind_a_very_thin_link_is_whole_at_the_end) {
  const SessionFigures figures = session({.viewers = {behind(1)}});
  EXPECT_EQ(figures.viewers[0].equals_server, "yes");
  EXPECT_GT(figures.viewers[0].states, 0);
}

// The link's queue lets marked packets overtake, as a switch does that heeds the marks.
TEST_F(Links, D_10_a_hand_doesnt_wait_behind_pictures_on_the_uplink_that_it_shares_with_them) {
  const SessionFigures figures = session({.server = {.up = {.rate_bit_per_s = 5 * kMbit}}, .viewers = {{}}});
  EXPECT_EQ(figures.viewers[0].equals_server, "yes");
  EXPECT_GT(figures.offered.expedited, 1000u);
  EXPECT_LT(figures.model_age_median_s, 0.02);
}

TEST_F(Links, D_10_a_slow_viewer_takes_nothing_from_the_others_and_from_the_hand) {
  const SessionFigures figures =
      session({.server = {.up = {.rate_bit_per_s = 100 * kMbit}}, .viewers = {behind(5), {}, {}}});
  for (const ViewerFigures& viewer : figures.viewers) EXPECT_EQ(viewer.equals_server, "yes");
  EXPECT_GT(figures.viewers[0].states, 5);
  EXPECT_GT(figures.viewers[1].states, 70);
  EXPECT_GT(figures.viewers[2].states, 70);
  EXPECT_LT(figures.model_age_median_s, 0.02);
}

TEST_F(Links, D_10_a_secured_session_behind_a_thin_and_lossy_link_is_whole_at_the_end) {
  const SessionFigures figures =
      session({.secured = true, .viewers = {{.down = {.rate_bit_per_s = 5 * kMbit, .loss = 0.02}}}});
  EXPECT_EQ(figures.viewers[0].equals_server, "yes");
  EXPECT_GT(figures.viewers[0].states, 10);
  EXPECT_LT(figures.offered.bytes, 40'000'000u);
}

// The server names nobody, and everybody the server: no address more has to be known.
TEST_F(Links, where_there_is_no_multicast_the_servers_address_is_enough) {
  const std::string root = SECTIO_SOURCE_DIR "/deploy/", bin = SECTIO_BIN_DIR "/";
  for (const bool names_server : {true, false}) {
    const HostLinks deaf{.hears_multicast = false};
    const VirtualNetwork network({deaf, deaf, deaf});
    const auto start = [&](std::size_t host, const std::string& program, std::vector<std::string> flags) {
      flags.insert(flags.end(), {"--session", "calm", "--interface", network.address(host), "--insecure"});
      if (host > 0 && names_server) flags.insert(flags.end(), {"--peer", network.address(0)});
      return std::make_unique<Process>(bin + program, flags, network.host(host));
    };
    const auto server =
        start(0, "sim_server",
              {"--scene", root + "scenes/liver_incision.yaml", "--wait-for-tools", "--wait-for-viewers", "1"});
    const auto viewer = start(2, "render_client", {"--no-pictures", "--duration-s", names_server ? "0" : "5"});
    if (!names_server) {
      EXPECT_EQ(viewer->exit_code(), 1) << "by multicast they would meet; " << viewer->output();
      continue;
    }
    const auto hand = start(1, "device_bridge", {"--trace", root + "traces/liver_incision.csv", "--wait-for-server"});
    EXPECT_EQ(viewer->exit_code(), 0) << viewer->output();
    EXPECT_NE(viewer->output().find("equals server: yes"), std::string::npos) << viewer->output();
    EXPECT_EQ(hand->exit_code(), 0) << hand->output();
    EXPECT_EQ(server->exit_code(), 0) << server->output();
  }
}

}  // namespace
}  // namespace sectio::test
