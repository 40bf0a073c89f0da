// Haply's Inverse3, with or without a VerseGrip, by the local service that its maker ships: JSON over a WebSocket, one
// state for each message. libwebsockets and JSON stay inside haply.cpp.
#pragma once

#include <memory>
#include <string>

#include "device_bridge/device/held_device.h"

namespace sectio {

struct HaplySpec {
  std::string host = "localhost";
  int port = 10001;
  std::string id;  // id of the Inverse3; empty: the first one
};

// Connects, and waits a few seconds for the first state. Throws InputError when there is no service or no device. A
// service that dies later is waited for.
std::unique_ptr<Handle> open_haply(const HaplySpec& spec);

}  // namespace sectio
