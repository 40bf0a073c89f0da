// The network, as the servo loop sees it.
#pragma once

#include "device_bridge/servo/servo_state.h"

namespace sectio {

// Called by the servo thread only; no call allocates, locks or waits.
class ServoLink {
 public:
  virtual ~ServoLink() = default;

  virtual void publish(const PoseSample& sample) = 0;

  // True when a newer model has come since the last call; otherwise `model` stays as it is.
  virtual bool latest_model(ContactModel& model) = 0;
};

}  // namespace sectio
