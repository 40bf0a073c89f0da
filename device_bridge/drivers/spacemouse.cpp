#include "device_bridge/drivers/spacemouse.h"

#include <poll.h>
#include <spnav.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <thread>

#include "common/core/error.h"
#include "common/core/latest_value.h"

namespace sectio {
namespace {

constexpr double kFull = 350;  // counts of a cap that is moved as far as it goes
constexpr int kPoll_ms = 20;
constexpr std::chrono::milliseconds kRetry{500};

struct CapState {
  bool here = false;
  std::array<double, 6> shares{};  // x, y, z, and about them; -1 to 1
  Buttons buttons;
};

bool open_socket(const std::string& path) {
  if (!path.empty()) setenv("SPNAV_SOCKET", path.c_str(), 1);
  return spnav_open() >= 0;
}

// libspnav takes a connection that has ended for one on which nothing happens.
bool has_ended() {
  char byte = 0;
  return recv(spnav_fd(), &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}

class Spacemouse : public Steering {
 public:
  explicit Spacemouse(const SpacemouseSpec& spec) : spec_(spec) {
    if (!open_socket(spec.socket))
      throw InputError("--device spacemouse: no spacenavd answers" +
                       (spec.socket.empty() ? std::string() : " at " + spec.socket));
    state_.here = true;
    states_.store(state_);
    thread_ = std::thread([this] { run(); });
  }
  ~Spacemouse() override {
    stop_ = true;
    thread_.join();
  }

  // Its z axis points away from the person, its y axis up; it turns about them as a left hand's fingers do.
  std::optional<Step> step(double dt_s) override {
    states_.load(state_);
    if (!state_.here) return std::nullopt;
    const auto& [x, y, z, rx, ry, rz] = state_.shares;
    Step step;
    step.way_m = dt_s * spec_.speed_m_per_s * Vec3(x, z, y);
    step.turn_rad = -dt_s * spec_.turn_rad_per_s * Vec3(rz, -rx, ry);
    step.buttons = state_.buttons;
    return step;
  }

 private:
  void run() {
    bool is_open = true;
    CapState cap = state_;
    while (!stop_) {
      if (!is_open) {
        std::this_thread::sleep_for(kRetry);
        is_open = !stop_ && open_socket(spec_.socket);
        cap = {};
      }
      if (is_open) is_open = hear(cap);
      cap.here = is_open;
      states_.store(cap);
    }
    if (is_open) spnav_close();
  }

  // False when the connection has ended.
  static bool hear(CapState& cap) {
    pollfd ready{spnav_fd(), POLLIN, 0};
    if (poll(&ready, 1, kPoll_ms) <= 0) return true;
    if (has_ended()) {
      spnav_close();
      return false;
    }
    spnav_event event;
    while (spnav_poll_event(&event)) {
      if (event.type == SPNAV_EVENT_MOTION)
        for (std::size_t i = 0; i < 6; ++i) cap.shares[i] = std::clamp(event.motion.data[i] / kFull, -1.0, 1.0);
      if (event.type == SPNAV_EVENT_BUTTON && event.button.bnum == 0) cap.buttons.grip = event.button.press != 0;
      if (event.type == SPNAV_EVENT_BUTTON && event.button.bnum == 1) cap.buttons.clutch = event.button.press != 0;
    }
    return true;
  }

  SpacemouseSpec spec_;
  LatestValue<CapState> states_;
  CapState state_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Steering> open_spacemouse(const SpacemouseSpec& spec) {
  return std::make_unique<Spacemouse>(spec);
}

bool spacemouse_is_here() {
  if (spnav_open() < 0) return false;
  spnav_close();
  return true;
}

}  // namespace sectio
