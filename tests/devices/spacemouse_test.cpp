// A space mouse: a socket that says what spacenavd says, a bridge and a server as real processes.
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>

#include "common/math/trace.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

class FakeSpacenavd {
 public:
  explicit FakeSpacenavd(const std::string& path) : listener_(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0) << path;
    EXPECT_EQ(listen(listener_, 4), 0);
  }
  ~FakeSpacenavd() {
    hang_up();
    close(listener_);
  }
  void accept_one() {
    client_ = accept(listener_, nullptr, nullptr);
    EXPECT_GE(client_, 0);
  }
  void hang_up() {
    if (client_ >= 0) close(client_);
    client_ = -1;
  }
  // Eight numbers an event: motion, x, y, z, about them, milliseconds; or a button that is pressed (1) or let go (2).
  void say(const std::array<int, 8>& event) const {
    EXPECT_EQ(send(client_, event.data(), sizeof event, MSG_NOSIGNAL), static_cast<ssize_t>(sizeof event));
  }

 private:
  int listener_, client_ = -1;
};

class Spacemouse : public test::SessionPrograms {};

TEST_F(Spacemouse, its_cap_leads_a_scalpel_into_the_liver) {
  const std::string path = "/dev/shm/sectio_spnav_" + std::to_string(getpid());
  FakeSpacenavd spacenavd(path);
  const auto sim = server({"--endless", "--export", file("out")}, 0);
  const auto hand =
      program("device_bridge",
              in_session({"--device", "spacemouse:socket=" + path, "--record", file("hand.csv"), "--wait-for-server"}));
  spacenavd.accept_one();
  ASSERT_TRUE(hand->wait_for("servers: 1")) << hand->output();
  spacenavd.say({1, 0, 0, 0, 0, 0, 0, 0});
  spacenavd.say({0, 0, -60, 0, 0, 0, 0, 16});  // down, by 17 mm/s: a server tells of cuts once a second
  while (cuts_told_by(*sim) == 0) ASSERT_TRUE(sim->wait_for_next(" cuts")) << sim->output();
  spacenavd.say({0, 0, 350, 0, 0, 0, 0, 16});
  ASSERT_TRUE(hand->wait_for_next("servers: 1")) << hand->output();

  spacenavd.hang_up();
  ASSERT_TRUE(hand->wait_for("warning: the device is lost")) << hand->output();
  spacenavd.accept_one();
  ASSERT_TRUE(hand->wait_for("the device is back")) << hand->output();
  hand->send(SIGINT);
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  sim->send(SIGINT);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
  const std::vector<TracePoint> moved = load_trace(file("hand.csv"));
  // It appeared above what the scene's camera looks at, and went down along the vertical at first.
  const Vec3 first_m = moved.front().pose_world.position_m;
  EXPECT_TRUE(first_m.isApprox(Vec3(-0.025, -0.010, 0.085), 1e-6)) << first_m.transpose();
  double lowest_m = 1;
  for (const TracePoint& point : moved) lowest_m = std::min(lowest_m, point.pose_world.position_m.z());
  EXPECT_LT(lowest_m, 0.05);
  unlink(path.c_str());
}

}  // namespace
}  // namespace sectio
