// The inputs of a session as plain values (idl/inputs.idl): a scene, a version and these are all that a session is.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/messages/tool.h"

namespace sectio {

constexpr std::size_t kMaxRecordsPerMessage = 4096;
constexpr std::size_t kMaxPacketsPerStep = 4096;

// Everything that one step of a simulation gets, and hashes of the bodies that get it.
struct StepRecord {
  std::uint64_t step = 0;               // from 1
  std::uint64_t hash_before = 0;        // all bodies' topology before the step
  std::uint64_t state_hash_before = 0;  // topology and vertex positions of all bodies; 0 in most steps
  std::vector<ToolPacket> packets;      // the samples, in order
  std::vector<std::uint32_t> withdrawn_tools;
  bool spare_idle_bodies = false;
  bool turns_gravity = false;
  Vec3 gravity_m_per_s2 = Vec3::Zero();  // gravity turns to this
  std::string overrun;
};

// A message without steps says that the server lives.
struct StepInputs {
  std::uint64_t epoch = 0;
  std::uint64_t newest_step = 0;  // the server's newest step
  std::vector<StepRecord> steps;  // ascending
};

struct StepRequest {
  std::uint64_t epoch = 0;
  std::uint64_t first_step = 1;
  std::uint64_t client = 0;
};

}  // namespace sectio
