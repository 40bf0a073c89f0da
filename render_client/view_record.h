// What a viewer did and saw, as numbers: for report.json and the line that says whether its bodies equal the server's.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/messages/session.h"
#include "render_client/net/client_net.h"
#include "render_client/replica/world.h"

namespace sectio {

class ViewRecord {
 public:
  // Once for each picture: when it was complete, how long it took to draw, and whether it shows a new state.
  void add(double now_s, double draw_time_s, const Frame& frame, bool is_new);

  // Once for each look at the network: what taking and applying all that had come took.
  void add_sync(double sync_time_s, const World& world);

  std::uint64_t pictures() const { return pictures_; }
  double pictures_per_s() const;

  // Of the bodies at the end. `end`: what the server said they are, if it did.
  std::string json(const std::string& name, const World& world, const ClientNetCounts& net,
                   const std::vector<BodyVersion>& versions, const std::optional<SessionEnd>& end) const;

 private:
  std::uint64_t pictures_ = 0;
  std::uint64_t states_ = 0;
  std::uint64_t first_step_ = 0;
  std::uint64_t last_step_ = 0;
  double begun_s_ = 0;
  double last_s_ = 0;
  double max_gap_s_ = 0;
  double max_tip_depth_m_ = 0;
  std::vector<double> intervals_s_;
  std::vector<double> draw_times_s_;
  std::vector<double> sync_times_s_;
  double sync_total_s_ = 0;
  double servers_apart_s_ = 0;  // at most
};

// "yes", "no", or "unknown" when the server hasn't said.
std::string equals_server(std::size_t body, const std::vector<BodyVersion>& versions,
                          const std::optional<SessionEnd>& end);

std::string hex(std::uint64_t hash);

}  // namespace sectio
