#include "device_bridge/drivers/device_table.h"

#include <array>
#include <cmath>
#include <numbers>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "device_bridge/device/scripted_device.h"
#include "device_bridge/device/virtual_hand.h"
#include "device_bridge/drivers/device_options.h"
#include "device_bridge/drivers/force_dimension.h"
#include "device_bridge/drivers/gamepad.h"
#include "device_bridge/drivers/haply.h"
#include "device_bridge/drivers/library.h"
#include "device_bridge/drivers/mouse.h"
#include "device_bridge/drivers/open_haptics.h"
#include "device_bridge/drivers/port_probe.h"
#include "device_bridge/drivers/spacemouse.h"
#include "device_bridge/drivers/tracker.h"

namespace sectio {
namespace {

constexpr double kAboveTarget_m = 0.05;  // an instrument appears so high above what the scene's camera looks at
constexpr double kRad_per_deg = std::numbers::pi / 180;

struct DeviceKind {
  const char* name;
  const char* options;
  const char* meaning;
  std::string (*here)();  // null: always
  void (*prepare)(DeviceOptions&, const DeviceRequest&, PreparedDevice&);
};

void read_workspace(DeviceOptions& options, PreparedDevice& prepared) {
  Workspace& w = prepared.workspace;
  if (const auto place_m = options.place_m("at_m")) {
    w.at_world_m = *place_m;
    prepared.has_place = true;
  }
  constexpr double kNotGiven = 1e9;
  const double turn_deg = options.number("turn_deg", kNotGiven, -360, 360);
  prepared.has_turn = turn_deg != kNotGiven;
  if (prepared.has_turn) w.turn_rad = kRad_per_deg * turn_deg;
  w.roll_rad = kRad_per_deg * options.number("roll_deg", 0, -360, 360);
  w.scale = options.number("scale", 1, 0.01, 100);
}

void read_forces(DeviceOptions& options, PreparedDevice& prepared) {
  prepared.workspace.force_scale = options.number("force_scale", 1, 0.01, 10);
  prepared.most_force_n = options.number("max_force_n", prepared.most_force_n, 0, 100);
}

std::vector<TracePoint> trace_of(const DeviceOptions& options, const DeviceRequest& request) {
  if (request.trace_file.empty()) throw InputError("--trace: needed by --device " + options.name());
  return load_trace(request.trace_file);
}

void prepare_scripted(DeviceOptions& options, const DeviceRequest& request, PreparedDevice& prepared) {
  options.check_keys();
  prepared.whole = std::make_unique<ScriptedDevice>(trace_of(options, request));
}

void prepare_virtual_hand(DeviceOptions& options, const DeviceRequest& request, PreparedDevice& prepared) {
  HandSpec spec;
  spec.tremor_m = 0.001 * options.number("tremor_mm", 1000 * spec.tremor_m, 0, 10);
  spec.seed = static_cast<std::uint64_t>(options.number("seed", static_cast<double>(spec.seed), 0, 1e9));
  options.check_keys();
  prepared.whole = std::make_unique<VirtualHand>(trace_of(options, request), spec);
}

void prepare_wish(DeviceOptions& options, const DeviceRequest&, PreparedDevice&) {
  options.check_keys();
}

void prepare_haply(DeviceOptions& options, const DeviceRequest&, PreparedDevice& prepared) {
  read_workspace(options, prepared);
  read_forces(options, prepared);
  HaplySpec spec;
  spec.host = options.text("host", spec.host);
  spec.port = static_cast<int>(options.number("port", spec.port, 1, 65535));
  spec.id = options.text("id", "");
  options.check_keys();
  prepared.handle = open_haply(spec);
}

void prepare_force_dimension(DeviceOptions& options, const DeviceRequest&, PreparedDevice& prepared) {
  read_workspace(options, prepared);
  read_forces(options, prepared);
  const std::string library = options.text("library", kForceDimensionLibrary);
  options.check_keys();
  prepared.handle = open_force_dimension(library);
}

void prepare_open_haptics(DeviceOptions& options, const DeviceRequest&, PreparedDevice& prepared) {
  read_workspace(options, prepared);
  read_forces(options, prepared);
  const std::string library = options.text("library", kOpenHapticsLibrary), device = options.text("id", "");
  options.check_keys();
  prepared.handle = open_open_haptics(library, device);
}

void read_speed(DeviceOptions& options, double& speed_m_per_s) {
  speed_m_per_s = options.number("speed_m_per_s", speed_m_per_s, 0.001, 1);
}

void prepare_gamepad(DeviceOptions& options, const DeviceRequest&, PreparedDevice& prepared) {
  read_workspace(options, prepared);
  GamepadSpec spec;
  spec.name = options.text("id", "");
  read_speed(options, spec.speed_m_per_s);
  options.check_keys();
  prepared.steering = open_gamepad(spec);
}

void prepare_spacemouse(DeviceOptions& options, const DeviceRequest&, PreparedDevice& prepared) {
  read_workspace(options, prepared);
  SpacemouseSpec spec;
  spec.socket = options.text("socket", "");
  read_speed(options, spec.speed_m_per_s);
  options.check_keys();
  prepared.steering = open_spacemouse(spec);
}

void prepare_mouse(DeviceOptions& options, const DeviceRequest&, PreparedDevice& prepared) {
  read_workspace(options, prepared);
  MouseSpec spec;
  spec.way_m_per_count = 0.001 * options.number("mm_per_count", 1000 * spec.way_m_per_count, 0.001, 10);
  options.check_keys();
  prepared.steering = open_mouse(spec);
}

void prepare_tracker(DeviceOptions& options, const DeviceRequest&, PreparedDevice& prepared) {
  read_workspace(options, prepared);
  TrackerSpec spec;
  spec.host = options.text("host", spec.host);
  spec.port = static_cast<int>(options.number("port", spec.port, 1, 65535));
  spec.name = options.text("id", "");
  options.check_keys();
  prepared.handle = open_tracker(spec);
  prepared.pushes = false;
}

std::string haply_here() {
  return listens_at(HaplySpec{}.host, HaplySpec{}.port) ? "its service answers" : "";
}
std::string tracker_here() {
  return listens_at(TrackerSpec{}.host, TrackerSpec{}.port) ? "a server answers" : "";
}

std::string spacemouse_here() {
  return spacemouse_is_here() ? "spacenavd answers" : "";
}
std::string desktop_here() {
  return desktop_is_here() ? "a desktop" : "";
}
std::string force_dimension_here() {
  return Library::is_here(kForceDimensionLibrary) ? kForceDimensionLibrary : "";
}
std::string open_haptics_here() {
  return Library::is_here(kOpenHapticsLibrary) ? kOpenHapticsLibrary : "";
}

#define SECTIO_PLACE "at_m, turn_deg, roll_deg, scale"
constexpr std::array kDevices{
    DeviceKind{"scripted", "--trace", "exactly the trace; forces don't change it", nullptr, prepare_scripted},
    DeviceKind{"virtual_hand", "--trace; tremor_mm, seed",
               "a simulated person who wants to follow the trace, and gives way to forces", nullptr,
               prepare_virtual_hand},
    DeviceKind{"wish", "--max-speed-m-per-s", "a person at a browser's page, by way of the gateway", nullptr,
               prepare_wish},
    DeviceKind{"haply", SECTIO_PLACE ", force_scale, max_force_n, host, port, id",
               "Haply's Inverse3 with or without a VerseGrip, by its maker's service; pushes the hand", haply_here,
               prepare_haply},
    DeviceKind{"force_dimension", SECTIO_PLACE ", force_scale, max_force_n, library",
               "omega, delta, sigma, lambda, Falcon, by their maker's libdhd; pushes the hand", force_dimension_here,
               prepare_force_dimension},
    DeviceKind{"open_haptics", SECTIO_PLACE ", force_scale, max_force_n, library, id",
               "Touch and Phantom, by their maker's libHD; pushes the hand", open_haptics_here, prepare_open_haptics},
    DeviceKind{"tracker", SECTIO_PLACE ", host, port, id", "a tracker, by OpenIGTLink", tracker_here, prepare_tracker},
    DeviceKind{"gamepad", SECTIO_PLACE ", speed_m_per_s, id", "sticks and triggers are speeds", gamepads_here,
               prepare_gamepad},
    DeviceKind{"spacemouse", SECTIO_PLACE ", speed_m_per_s, socket", "a space mouse, by spacenavd", spacemouse_here,
               prepare_spacemouse},
    DeviceKind{"mouse", SECTIO_PLACE ", mm_per_count", "a mouse in a small window of this desktop", desktop_here,
               prepare_mouse},
};
#undef SECTIO_PLACE

}  // namespace

std::unique_ptr<Device> PreparedDevice::finish(WishSource& wishes, const std::optional<Camera>& camera) {
  if (whole) return std::move(whole);
  if (!handle && !steering) return std::make_unique<WishHand>(wishes, fastest_m_per_s);
  if (camera && !has_place) workspace.at_world_m = camera->target_world_m + Vec3(0, 0, kAboveTarget_m);
  if (camera && !has_turn) {
    const Vec3 ahead = camera->target_world_m - camera->eye_world_m;  // away from the person who looks at the scene
    if (ahead.head<2>().norm() > 0.01 * ahead.norm()) workspace.turn_rad = std::atan2(-ahead.x(), ahead.y());
  }
  if (handle && !pushes) return std::make_unique<TrackedHand>(std::move(handle), workspace, fastest_m_per_s);
  if (handle) return std::make_unique<HeldDevice>(std::move(handle), workspace, most_force_n);
  return std::make_unique<SteeredHand>(std::move(steering), workspace, fastest_m_per_s);
}

PreparedDevice prepare_device(const DeviceRequest& request) {
  DeviceOptions options(request.device);
  std::string names;
  for (const DeviceKind& kind : kDevices) {
    names += (names.empty() ? "" : ", ") + std::string(kind.name);
    if (options.name() != kind.name) continue;
    if (!request.trace_file.empty() && !std::string(kind.options).starts_with("--trace"))
      throw InputError("--trace: --device " + options.name() + " plays none");
    PreparedDevice prepared;
    prepared.fastest_m_per_s = request.fastest_m_per_s;
    kind.prepare(options, request, prepared);
    return prepared;
  }
  throw InputError("--device: expected one of " + names + ", got '" + options.name() + "'");
}

std::vector<std::string> device_list() {
  std::vector<std::string> lines;
  for (const DeviceKind& kind : kDevices) {
    const std::string found = kind.here ? kind.here() : "";
    const std::string here = !kind.here ? "" : found.empty() ? "; not here" : "; here: " + found;
    lines.push_back(formatted("%-15s  %-74s  %s%s", kind.name, kind.options, kind.meaning, here.c_str()));
  }
  return lines;
}

}  // namespace sectio
