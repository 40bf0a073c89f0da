// A tracker: a server of OpenIGTLink in this process, which tells places.
#include <gtest/gtest.h>
#include <igtlServerSocket.h>
#include <igtlTransformMessage.h>

#include <functional>
#include <thread>

#include "common/core/error.h"
#include "device_bridge/device/tracked_hand.h"
#include "device_bridge/drivers/tracker.h"
#include "tests/support/patience.h"

namespace sectio {
namespace {

// Tells one place, again and again, to whoever connects.
class FakeTracker {
 public:
  FakeTracker() : server_(igtl::ServerSocket::New()) {
    EXPECT_EQ(server_->CreateServer(0), 0);
    port_ = server_->GetServerPort();
    thread_ = std::thread([this] { run(); });
  }
  ~FakeTracker() {
    stop_ = true;
    thread_.join();
    server_->CloseSocket();
  }
  int port() const { return port_; }
  std::atomic<float> x_mm{0}, z_mm{0};
  std::atomic<bool> hangs_up{false};

 private:
  void run() {
    igtl::ClientSocket::Pointer client;
    while (!stop_) {
      if (hangs_up && client.IsNotNull()) {
        client->CloseSocket();
        client = nullptr;
      }
      if (client.IsNull() && !hangs_up) client = server_->WaitForConnection(20);
      if (client.IsNull()) continue;
      if (!tell(*client, "Camera", 500) || !tell(*client, "Stylus", x_mm)) client = nullptr;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    if (client.IsNotNull()) client->CloseSocket();
  }
  bool tell(igtl::ClientSocket& client, const char* name, float x) const {
    const igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
    igtl::Matrix4x4 place = {{0, -1, 0, x}, {1, 0, 0, 0}, {0, 0, 1, z_mm}, {0, 0, 0, 1}};
    message->SetDeviceName(name);
    message->SetMatrix(place);
    message->Pack();
    return client.Send(message->GetPackPointer(), message->GetPackSize()) != 0;
  }

  igtl::ServerSocket::Pointer server_;
  int port_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// Runs a hand as the servo does until a condition holds.
bool until(TrackedHand& hand, double& now_s, const std::function<bool(const Pose&)>& holds) {
  return test::wait_until([&] { return holds(hand.pose_world(now_s += 0.001)); }, {}, test::kGiveUpDevice);
}

TEST(Tracker, leads_a_mass_along_the_places_that_it_tells) {
  FakeTracker fake;
  TrackedHand hand(open_tracker({.port = fake.port(), .name = "Stylus"}), {.at_world_m = Vec3(0, 0, 0.1)}, 5);
  double now_s = 0;
  ASSERT_TRUE(until(hand, now_s, [&](const Pose& p) { return hand.present() && p.position_m.z() == 0.1; }));
  const Vec3 before_m = hand.pose_world(now_s).position_m;
  fake.x_mm = 30;
  fake.z_mm = -20;
  EXPECT_TRUE(until(hand, now_s,
                    [&](const Pose& p) { return (p.position_m - before_m - Vec3(0.03, 0, -0.02)).norm() < 1e-4; }));
  EXPECT_TRUE((hand.pose_world(now_s).orientation * Vec3::UnitX()).isApprox(Vec3::UnitY(), 1e-3));
  fake.hangs_up = true;
  EXPECT_TRUE(until(hand, now_s, [&](const Pose&) { return hand.status() == DeviceStatus::lost; }));
  EXPECT_TRUE(until(hand, now_s, [&](const Pose&) { return !hand.present(); })) << "it is drawn out";
  fake.hangs_up = false;
  EXPECT_TRUE(until(hand, now_s, [&](const Pose&) { return hand.present(); }));
  EXPECT_NEAR(hand.pose_world(now_s).position_m.z(), 0.1, 1e-3) << "outside, as at first";
}

TEST(Tracker, without_a_server_or_its_places_there_is_a_line) {
  EXPECT_THROW(open_tracker({.port = 1}), InputError);
  FakeTracker fake;
  try {
    open_tracker({.port = fake.port(), .name = "Needle"});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("tells no place of 'Needle'"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace sectio
