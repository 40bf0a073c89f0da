// A gamepad, by SDL: its sticks are speeds. SDL stays inside gamepad.cpp.
#pragma once

#include <memory>
#include <string>

#include "device_bridge/device/steered_hand.h"

namespace sectio {

struct GamepadSpec {
  std::string name = {};  // a part of its name; empty: the first one
  double speed_m_per_s = 0.05;
  double turn_rad_per_s = 1.5;
};

// Throws InputError when there is none. One that is unplugged is waited for.
std::unique_ptr<Steering> open_gamepad(const GamepadSpec& spec);
// The names of those that are here, for a list.
std::string gamepads_here();

}  // namespace sectio
