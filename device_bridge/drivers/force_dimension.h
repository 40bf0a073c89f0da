// Force Dimension's omega, delta, sigma and lambda, and Novint's Falcon, by their maker's library (libdhd), where the
// owner has it.
#pragma once

#include <memory>
#include <string>

#include "device_bridge/device/held_device.h"

namespace sectio {

constexpr const char* kForceDimensionLibrary = "libdhd.so.3";

// Throws InputError when there is no such library or no device.
std::unique_ptr<Handle> open_force_dimension(const std::string& library);

}  // namespace sectio
