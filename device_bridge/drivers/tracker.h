// A tracker, or whatever else says places as TRANSFORM messages of OpenIGTLink (PLUS, 3D Slicer). The library stays
// inside tracker.cpp.
#pragma once

#include <memory>
#include <string>

#include "device_bridge/device/held_device.h"

namespace sectio {

struct TrackerSpec {
  std::string host = "localhost";
  int port = 18944;
  std::string name = {};  // the device's name in the messages; empty: the first that is heard
};

// Connects to a server of OpenIGTLink, and waits a few seconds for the first place. Throws InputError without one. A
// server that dies is waited for.
std::unique_ptr<Handle> open_tracker(const TrackerSpec& spec);

}  // namespace sectio
