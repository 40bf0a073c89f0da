// The input of a step as a record that is sent and kept, and back; and the hashes by which two simulations of the same
// inputs are compared.
#pragma once

#include <string>

#include "common/messages/inputs.h"
#include "sim_server/simulation.h"

namespace sectio {

constexpr std::uint64_t kStatesHashedEvery = 64;  // steps

// Whole steps up to a simulated time: none before 0, as many as there can be when it is too far away.
std::uint64_t steps_until(double time_s, double step_s);

// The topology of all bodies. O(bodies).
std::uint64_t topology_hash_of(const Simulation& simulation);
// The topology, and the position of every vertex. O(all). Never 0.
std::uint64_t state_hash_of(const Simulation& simulation);

// The record of a step that is about to be run.
StepRecord record_of(std::uint64_t step, const StepInput& input, const Simulation& before);
// The input that a record holds: that of record_of(), bit for bit.
StepInput input_of(const StepRecord& record);

// How a simulation differs from the one of the record, before the step; empty: as far as the record says, in nothing.
std::string difference(const StepRecord& record, const Simulation& before);

}  // namespace sectio
