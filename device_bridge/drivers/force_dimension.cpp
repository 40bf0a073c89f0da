#include "device_bridge/drivers/force_dimension.h"

#include <thread>

#include "device_bridge/drivers/library.h"
#include "device_bridge/drivers/polled_handle.h"

namespace sectio {
namespace {

using Frame = double[3][3];

// The functions of libdhd that are used, with prototypes of our own.
struct Dhd {
  explicit Dhd(const std::string& file) : library("force_dimension", file) {
    library.find("dhdOpen", open);
    library.find("dhdClose", close);
    library.find("dhdErrorGetLastStr", last_error);
    library.find("dhdHasWrist", has_wrist);
    library.find("dhdHasGripper", has_gripper);
    library.find("dhdEnableForce", enable_force);
    library.find("dhdGetPositionAndOrientationFrame", get_pose);
    library.find("dhdGetGripperAngleRad", get_gripper_rad);
    library.find("dhdGetButton", get_button);
    library.find("dhdSetForceAndTorqueAndGripperForce", set_load);
  }

  Library library;
  int (*open)() = nullptr;
  int (*close)(char) = nullptr;
  const char* (*last_error)() = nullptr;
  bool (*has_wrist)(char) = nullptr;
  bool (*has_gripper)(char) = nullptr;
  int (*enable_force)(unsigned char, char) = nullptr;
  int (*get_pose)(double*, double*, double*, Frame, char) = nullptr;
  int (*get_gripper_rad)(double*, char) = nullptr;
  int (*get_button)(int, char) = nullptr;
  int (*set_load)(double, double, double, double, double, double, double, char) = nullptr;
};

constexpr double kWideGripper_rad = 0.5;
constexpr std::chrono::microseconds kPause{100};  // a library that doesn't wait for its device must not take a core

// Its x axis points at the person, y to the right, z up.
Mat3 dhd_axes() {
  Mat3 ours_of_theirs;
  ours_of_theirs << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  return ours_of_theirs;
}

// The shaft goes up along the handle's x axis, towards the person; the sharp edge is below, along -z.
Mat3 instrument_in_handle() {
  Mat3 columns;
  columns.col(0) = -Vec3::UnitZ();
  columns.col(1) = Vec3::UnitY();
  columns.col(2) = Vec3::UnitX();
  return columns;
}

class ForceDimension : public PolledHandle {
 public:
  explicit ForceDimension(const std::string& file) : dhd_(file), id_(static_cast<char>(dhd_.open())) {
    if (id_ < 0) throw InputError(std::string("--device force_dimension: no device answers: ") + dhd_.last_error());
    has_wrist_ = dhd_.has_wrist(id_);
    has_gripper_ = dhd_.has_gripper(id_);
    dhd_.enable_force(1, id_);
    poll();
    if (lost()) {
      dhd_.close(id_);
      throw InputError(std::string("--device force_dimension: no pose: ") + dhd_.last_error());
    }
    thread_ = std::thread([this] {
      while (!stop_) {
        poll();
        std::this_thread::sleep_for(kPause);
      }
    });
  }
  ~ForceDimension() override {
    stop_ = true;
    thread_.join();
    dhd_.set_load(0, 0, 0, 0, 0, 0, 0, id_);
    dhd_.close(id_);
  }

  DeviceLimits limits() const override { return {.largest_force_n = 8, .largest_moment_n_m = has_wrist_ ? 0.1 : 0}; }

 private:
  void poll() {
    Vec3 at_m;
    Frame frame{};
    if (dhd_.get_pose(&at_m.x(), &at_m.y(), &at_m.z(), frame, id_) < 0) return;
    HandleState state;
    state.pose.position_m = dhd_axes() * at_m;
    if (has_wrist_) {
      const Mat3 turned = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&frame[0][0]);
      state.pose.orientation = Eigen::Quaterniond(Mat3(dhd_axes() * turned * instrument_in_handle())).normalized();
    }
    double gripper_rad = 0;
    if (has_gripper_ && dhd_.get_gripper_rad(&gripper_rad, id_) >= 0) {
      state.has_opening = true;
      state.opening_share = gripper_rad / kWideGripper_rad;
    }
    state.buttons = {dhd_.get_button(1, id_) > 0, !has_gripper_ && dhd_.get_button(0, id_) > 0};
    const HandLoad& load = load_now();
    const Vec3 f = dhd_axes().transpose() * load.force_n, m = dhd_axes().transpose() * load.moment_n_m;
    if (dhd_.set_load(f.x(), f.y(), f.z(), m.x(), m.y(), m.z(), 0, id_) >= 0) heard(state);
  }

  Dhd dhd_;
  char id_;
  bool has_wrist_ = false, has_gripper_ = false;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Handle> open_force_dimension(const std::string& library) {
  return std::make_unique<ForceDimension>(library);
}

}  // namespace sectio
