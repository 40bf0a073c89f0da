// The bridge's end of the wire. The 1 kHz loop must neither lock nor allocate, which writing to DDS does: it hands its
// samples to a thread through a ring and gets the newest contact model out of a slot.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "common/dds/participant.h"
#include "common/math/camera.h"
#include "common/math/contact_model.h"
#include "common/messages/tool.h"
#include "device_bridge/servo/servo_state.h"

namespace sectio {

class BridgeNet {
 public:
  // Throws InputError for bad options, and for a tool that no scene can have.
  BridgeNet(const NetworkOptions& options, std::uint32_t tool_id);
  ~BridgeNet();

  // Servo thread. No lock, no allocation; wakes the thread that sends. Samples ascend in sequence. A sample is dropped
  // when that thread could not run for 64 ms.
  void publish(const PoseSample& sample);

  // Servo thread. True when a newer model of this tool has come since the last call.
  bool latest_model(ContactModel& model);

  // Servo thread. True when a newer wish for this tool has come since the last call.
  bool latest_wish(ToolWish& wish);

  // Any thread. A session that has ended stays ended.
  std::uint32_t servers() const;  // servers that listen now
  bool met_a_server() const;      // a server has listened at any time
  bool session_ended() const;
  bool session_paused() const;           // or it has not begun: it waits for somebody
  std::optional<Camera> camera() const;  // camera of the first scene that has come
  bool lacks_tool() const;               // scenes have come, and none of them has our tool

  std::uint64_t packets_sent() const;
  std::uint64_t samples_dropped() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sectio
