// The devices by name: what each one is, whether it is here, and how its options make one.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/math/camera.h"
#include "common/math/trace.h"
#include "device_bridge/device/held_device.h"
#include "device_bridge/device/steered_hand.h"
#include "device_bridge/device/tracked_hand.h"
#include "device_bridge/device/wish_hand.h"

namespace sectio {

struct DeviceRequest {
  std::string device = "scripted";  // NAME or NAME:KEY=VALUE,...
  std::string trace_file;
  double fastest_m_per_s = kUsualMaxSpeed_m_per_s;  // wishes, and devices that say where to go
};

// A device that has been opened, and lacks only what a session knows.
class PreparedDevice {
 public:
  // Its options don't say where the instrument appears: the scene does.
  bool wants_scene() const { return (handle || steering) && !(has_place && has_turn); }
  // Call once. Without a camera of the scene, the axes of the world serve.
  std::unique_ptr<Device> finish(WishSource& wishes, const std::optional<Camera>& camera);

  // One of `whole`, `handle` and `steering` is set; none where the motion comes over the network.
  std::unique_ptr<Device> whole;
  std::unique_ptr<Handle> handle;
  bool pushes = true;  // the handle can push the hand
  std::unique_ptr<Steering> steering;

  Workspace workspace;
  bool has_place = false, has_turn = false;
  double most_force_n = 1e9;
  double fastest_m_per_s = kUsualMaxSpeed_m_per_s;
};

// Throws InputError, one clear line, for a name or an option that there isn't, and for a device that isn't here.
PreparedDevice prepare_device(const DeviceRequest& request);

// A line for each device: its name, its options, and what it is, with whether it is here.
std::vector<std::string> device_list();

}  // namespace sectio
