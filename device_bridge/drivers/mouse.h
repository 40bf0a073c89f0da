// A mouse of this machine's desktop, without a browser: a small window takes it. SDL stays inside mouse.cpp.
#pragma once

#include <memory>

#include "device_bridge/device/steered_hand.h"

namespace sectio {

struct MouseSpec {
  double way_m_per_count = 1e-4;
  double wheel_m = 0.001;  // way of the instrument for a notch
};

// Throws InputError when there is no desktop. A window that is closed is a device that is lost.
std::unique_ptr<Steering> open_mouse(const MouseSpec& spec);
bool desktop_is_here();

}  // namespace sectio
