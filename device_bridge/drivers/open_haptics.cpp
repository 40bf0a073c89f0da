#include "device_bridge/drivers/open_haptics.h"

#include "device_bridge/drivers/library.h"
#include "device_bridge/drivers/polled_handle.h"

namespace sectio {
namespace {

constexpr unsigned kInvalid = 0xFFFFFFFFU;
constexpr unsigned kButtons = 0x2000, kTransform = 0x2052, kForce = 0x2700, kMostForce = 0x2603, kForceOutput = 0x4000;
constexpr unsigned kContinue = 1;
constexpr unsigned short kPriority = 500;

struct HdError {
  unsigned code = 0;
  int internal = 0;
  unsigned device = 0;
};

// The functions of libHD that are used, with prototypes of our own.
struct Hd {
  explicit Hd(const std::string& file) : library("open_haptics", file) {
    library.find("hdInitDevice", init_device);
    library.find("hdDisableDevice", disable_device);
    library.find("hdEnable", enable);
    library.find("hdStartScheduler", start);
    library.find("hdStopScheduler", stop);
    library.find("hdScheduleAsynchronous", schedule);
    library.find("hdUnschedule", unschedule);
    library.find("hdBeginFrame", begin_frame);
    library.find("hdEndFrame", end_frame);
    library.find("hdGetDoublev", get_doubles);
    library.find("hdGetIntegerv", get_integers);
    library.find("hdSetDoublev", set_doubles);
    library.find("hdGetError", get_error);
  }

  Library library;
  unsigned (*init_device)(const char*) = nullptr;
  void (*disable_device)(unsigned) = nullptr;
  void (*enable)(unsigned) = nullptr;
  void (*start)() = nullptr;
  void (*stop)() = nullptr;
  unsigned long (*schedule)(unsigned (*)(void*), void*, unsigned short) = nullptr;
  void (*unschedule)(unsigned long) = nullptr;
  void (*begin_frame)(unsigned) = nullptr;
  void (*end_frame)(unsigned) = nullptr;
  void (*get_doubles)(unsigned, double*) = nullptr;
  void (*get_integers)(unsigned, int*) = nullptr;
  void (*set_doubles)(unsigned, const double*) = nullptr;
  HdError (*get_error)() = nullptr;
};

// Its x axis points to the right, y up, z at the person; lengths are millimetres.
Mat3 hd_axes() {
  Mat3 ours_of_theirs;
  ours_of_theirs << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return ours_of_theirs;
}

// The shaft goes up along the z axis of the stylus; the sharp edge is below, along -y.
Mat3 instrument_in_stylus() {
  Mat3 columns;
  columns.col(0) = -Vec3::UnitY();
  columns.col(1) = Vec3::UnitX();
  columns.col(2) = Vec3::UnitZ();
  return columns;
}

class OpenHaptics : public PolledHandle {
 public:
  OpenHaptics(const std::string& file, const std::string& device)
      : hd_(file), id_(hd_.init_device(device.empty() ? nullptr : device.c_str())) {
    if (id_ == kInvalid || hd_.get_error().code != 0)
      throw InputError("--device open_haptics: no device" + (device.empty() ? "" : " '" + device + "'") + " answers");
    hd_.get_doubles(kMostForce, &most_n_);
    hd_.enable(kForceOutput);
    hd_.start();
    callback_ = hd_.schedule(on_tick, this, kPriority);
  }
  ~OpenHaptics() override {
    hd_.unschedule(callback_);
    hd_.stop();
    hd_.disable_device(id_);
  }

  DeviceLimits limits() const override {
    return {.largest_force_n = most_n_ > 0 ? most_n_ : 3, .largest_moment_n_m = 0};
  }

 private:
  // In the library's own thread, at 1 kHz.
  static unsigned on_tick(void* self) {
    static_cast<OpenHaptics*>(self)->tick();
    return kContinue;
  }
  void tick() {
    Eigen::Matrix4d place = Eigen::Matrix4d::Identity();  // column after column, as theirs
    int buttons = 0;
    hd_.begin_frame(id_);
    hd_.get_doubles(kTransform, place.data());
    hd_.get_integers(kButtons, &buttons);
    const Vec3 force_n = hd_axes().transpose() * load_now().force_n;
    hd_.set_doubles(kForce, force_n.data());
    hd_.end_frame(id_);
    if (hd_.get_error().code != 0 || !place.allFinite()) return;
    HandleState state;
    state.pose.position_m = 1e-3 * (hd_axes() * place.topRightCorner<3, 1>());
    state.pose.orientation =
        Eigen::Quaterniond(Mat3(hd_axes() * place.topLeftCorner<3, 3>() * instrument_in_stylus())).normalized();
    state.buttons = {(buttons & 2) != 0, (buttons & 1) != 0};
    heard(state);
  }

  Hd hd_;
  unsigned id_;
  double most_n_ = 0;
  unsigned long callback_ = 0;
};

}  // namespace

std::unique_ptr<Handle> open_open_haptics(const std::string& library, const std::string& device) {
  return std::make_unique<OpenHaptics>(library, device);
}

}  // namespace sectio
