// Everything that a running session takes in: poses of instruments, and requests to turn gravity. The simulation's
// thread only; nothing blocks.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sim_server/net/sample_deduplicator.h"
#include "sim_server/net/server_endpoints.h"

namespace sectio {

class Intake {
 public:
  // `tools`: the number of tools of the scene. The endpoints outlive the intake.
  Intake(ServerEndpoints& endpoints, std::size_t tools);

  // Appends the samples that have arrived since the last call, each once, in order of sequence for each tool.
  void take_samples(std::vector<ToolSample>& samples);

  // The newest gravity that somebody asked for since the last call.
  std::optional<Vec3> take_gravity();

  // Packets of unknown tools and of replaced bridges.
  std::uint64_t samples_refused() const { return deduplicator_.refused(); }

 private:
  ServerEndpoints& endpoints_;
  std::size_t tools_;
  SampleDeduplicator deduplicator_;
  std::uint64_t last_gravity_source_ = 0;
};

}  // namespace sectio
