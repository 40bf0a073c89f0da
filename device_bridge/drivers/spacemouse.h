// A space mouse (3Dconnexion and others) by the socket of spacenavd: its cap is a speed and a turn. libspnav stays
// inside spacemouse.cpp.
#pragma once

#include <memory>
#include <string>

#include "device_bridge/device/steered_hand.h"

namespace sectio {

struct SpacemouseSpec {
  std::string socket = {};  // socket of spacenavd; empty: its default
  double speed_m_per_s = 0.1;
  double turn_rad_per_s = 1.5;
};

// Throws InputError when spacenavd doesn't answer. One that dies is waited for. One of them in a program: libspnav has
// one connection.
std::unique_ptr<Steering> open_spacemouse(const SpacemouseSpec& spec);
bool spacemouse_is_here();

}  // namespace sectio
