// The hand's side of the wire as plain values (idl/tool.idl).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/math/types.h"

namespace sectio {

// One pose of an instrument as its device measured it.
struct ToolSample {
  std::uint32_t tool_id = 0;  // index into the scene's tools
  std::uint64_t sequence = 0;
  double tool_time_s = 0;  // by the clock of its source
  Pose pose_world;
  double opening_rad = 0;    // between the blades of an instrument that has a joint
  std::uint64_t source = 0;  // differs with every start of a bridge; sequence and clock begin anew with it
};

// Poses that a packet carries: at 1 kHz, four packets in a row must be lost before one pose is.
constexpr std::size_t kPosesPerPacket = 4;
constexpr std::size_t kMaxPosesPerPacket = 8;

// The newest samples of one instrument, in ascending order of sequence.
struct ToolPacket {
  std::uint64_t source = 0;  // source of all its samples: speaker.h
  std::uint32_t tool_id = 0;
  std::vector<ToolSample> samples;
};

// A hand without a device of its own (a mouse, a pad, a tracker) wishes an instrument at this place. Between the wish
// and the instrument stands a device_bridge (--device wish), which draws a mass along it. The newest wish holds.
struct ToolWish {
  std::uint64_t source = 0;  // differs with every start of the program that sends wishes: speaker.h
  std::uint32_t tool_id = 0;
  std::uint64_t sequence = 0;
  JointPose pose_world;
  bool held = true;  // false: the hand has let go of the instrument
};

}  // namespace sectio
