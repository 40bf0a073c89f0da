// A hand with an Inverse3: Haply's service (a fake), a bridge and a server as real processes.
#include <algorithm>

#include "common/core/formatted.h"
#include "common/math/trace.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

class Haply : public test::SessionPrograms {
 protected:
  static std::unique_ptr<Process> service(const std::string& port = "0", const std::string& version = "3.5.0.0") {
    return program("fake_haply", {kTrace, port, version});
  }
  static std::string port_of(Process& service) {
    EXPECT_TRUE(service.wait_for("port ")) << service.output();
    EXPECT_TRUE(service.wait_for("\n"));
    const std::string said = service.output();
    const std::size_t at = said.find("port ") + 5;
    return said.substr(at, said.find('\n') - at);
  }
  // The handle's way is the trace's own.
  static std::string device(const std::string& port) {
    const Vec3 at_m = load_trace(kTrace).front().pose_world.position_m;
    return formatted("haply:port=%s,turn_deg=0,at_m=%.6f/%.6f/%.6f", port.c_str(), at_m.x(), at_m.y(), at_m.z());
  }
  static double largest_force_n(const std::string& said) {
    const std::size_t at = said.find("largest force ");
    return at == std::string::npos ? -1 : std::stod(said.substr(at + 14));
  }
};

TEST_F(Haply, its_motion_cuts_and_its_hand_feels_the_tissue) {
  const auto sim = server({"--endless", "--export", file("out")}, 0);
  const auto haply = service();
  const std::string port = port_of(*haply);
  const auto hand = program("device_bridge",
                            in_session({"--device", device(port), "--record", file("hand.csv"), "--wait-for-server"}));
  ASSERT_TRUE(hand->wait_for("servers: 1")) << hand->output();
  haply->send(SIGUSR1);
  while (cuts_told_by(*sim) < 300) ASSERT_TRUE(sim->wait_for_next(" cuts")) << sim->output();
  hand->send(SIGINT);
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  sim->send(SIGINT);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  EXPECT_GE(json("out/report.json")["run"]["events"].value("penetrated", 0), 1);
  haply->send(SIGTERM);
  EXPECT_EQ(haply->exit_code(), 0);
  EXPECT_NE(haply->output().find("as vector, introduced"), std::string::npos) << haply->output();
  EXPECT_GT(largest_force_n(haply->output()), 0.1) << haply->output();
  EXPECT_LT(largest_force_n(haply->output()), 8.001) << haply->output();
  // The instrument was where the handle was, turned as the grip: near the trace, but for what the tissue pushed it.
  const std::vector<TracePoint> moved = load_trace(file("hand.csv")), wish = load_trace(kTrace);
  // A message for most ticks, and a state for each.
  EXPECT_GT(std::stoul(haply->output().substr(haply->output().find('\n') + 1)), moved.size() / 2) << haply->output();
  ASSERT_LT((moved.front().pose_world.position_m - wish.front().pose_world.position_m).norm(), 1e-6);
  for (const TracePoint& point : moved) {
    double nearest_m = 1, turned_rad = 4;
    for (std::size_t i = 0; i < wish.size(); ++i) {
      const Pose before = wish[i > 0 ? i - 1 : 0].pose_world;
      for (const double s : {0.25, 0.5, 0.75, 1.0}) {
        const Pose pose = interpolate(before, wish[i].pose_world, s);
        nearest_m = std::min(nearest_m, (point.pose_world.position_m - pose.position_m).norm());
        turned_rad = std::min(turned_rad, point.pose_world.orientation.angularDistance(pose.orientation));
      }
    }
    ASSERT_LT(nearest_m, 0.01) << point.time_s;
    ASSERT_LT(turned_rad, 0.05) << point.time_s;
  }
}

TEST_F(Haply, a_service_that_dies_is_a_device_that_is_lost_and_comes_back) {
  const auto sim = server({"--endless"}, 0);
  auto haply = service();
  const std::string port = port_of(*haply);
  const auto hand = program("device_bridge", in_session({"--device", device(port), "--wait-for-server"}));
  ASSERT_TRUE(hand->wait_for("servers: 1")) << hand->output();
  haply->send(SIGKILL);
  ASSERT_TRUE(hand->wait_for("warning: the device is lost")) << hand->output();
  // An older service names forces otherwise.
  haply = service(port, "3.1.2.0");
  ASSERT_TRUE(hand->wait_for("the device is back")) << hand->output();
  ASSERT_TRUE(hand->wait_for_next("servers: 1")) << hand->output();
  haply->send(SIGTERM);
  EXPECT_EQ(haply->exit_code(), 0);
  EXPECT_NE(haply->output().find("as values, introduced"), std::string::npos) << haply->output();
  ASSERT_TRUE(hand->wait_for_next("warning: the device is lost")) << hand->output();
  hand->send(SIGINT);
  EXPECT_EQ(hand->exit_code(), 1);
  EXPECT_NE(hand->output().find("error: --device haply"), std::string::npos) << hand->output();
  sim->send(SIGINT);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
}

TEST_F(Haply, without_a_service_or_its_device_there_is_a_line) {
  const auto haply = service();
  const std::string port = port_of(*haply);
  for (const auto& [device, said] :
       {std::pair<std::string, std::string>{"haply:port=1", "no service answers at ws://localhost:1 ("},
        {"haply:port=" + port + ",id=FFFF", "has no Inverse3 with the id 'FFFF'"}}) {
    const auto hand = program("device_bridge", {"--device", device});
    EXPECT_EQ(hand->exit_code(), 2);
    EXPECT_EQ(std::ranges::count(hand->output(), '\n'), 1) << hand->output();
    EXPECT_NE(hand->output().find(said), std::string::npos) << hand->output();
  }
}

}  // namespace
}  // namespace sectio
