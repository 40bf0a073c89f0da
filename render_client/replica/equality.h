// Whether a viewer's bodies equal those of the server: hashes are compared whenever both are at the same revision.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/messages/session.h"
#include "render_client/replica/world.h"

namespace sectio {

class Equality {
 public:
  struct OfBody {
    std::optional<bool> equal;  // when both were last at the same revision
    std::uint64_t revision = 0;
  };

  // The newest versions that a server has told.
  void hear(std::uint64_t epoch, const std::vector<BodyVersion>& server) { server_[epoch] = server; }
  // Call after each frame, so that no revision is missed.
  void compare(const World& world);
  // In the order of the bodies.
  std::vector<OfBody> of_bodies(const World& world) const;

 private:
  std::map<std::uint64_t, std::vector<BodyVersion>> server_;          // by epoch
  std::map<std::pair<std::uint64_t, std::size_t>, OfBody> compared_;  // by epoch and body
};

}  // namespace sectio
