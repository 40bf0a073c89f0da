// 3D Systems' Touch and Geomagic's Phantom by OpenHaptics (libHD), where the owner has it.
#pragma once

#include <memory>
#include <string>

#include "device_bridge/device/held_device.h"

namespace sectio {

constexpr const char* kOpenHapticsLibrary = "libHD.so";

// `device`: the name that the maker's set-up gave it; empty: the default one. Throws InputError when there is no such
// library or no device.
std::unique_ptr<Handle> open_open_haptics(const std::string& library, const std::string& device);

}  // namespace sectio
