// The numbers of a viewer for its report, and the comparison of its bodies with those of the server.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/messages/session.h"
#include "render_client/net/client_net.h"
#include "render_client/replica/equality.h"
#include "render_client/replica/world.h"

namespace sectio {

class ViewRecord {
 public:
  // For each picture: when it was complete, how long it took to draw, and whether it shows a new state.
  void add(double now_s, double draw_time_s, const Frame& frame, bool is_new);

  // For each look at the network: the time to take and apply the messages that had arrived.
  void add_sync(double sync_time_s, const World& world);

  std::uint64_t pictures() const { return pictures_; }
  double pictures_per_s() const;

  // `versions`: the versions of the bodies at the end. `equal`: whether they are the server's (equals_server()).
  std::string json(const std::string& name, const World& world, const ClientNetCounts& net,
                   const std::vector<BodyVersion>& versions, const std::vector<std::string>& equal) const;

 private:
  std::uint64_t pictures_ = 0;
  std::uint64_t states_ = 0;
  std::uint64_t first_step_ = 0;
  std::uint64_t last_step_ = 0;
  double begun_s_ = 0;
  double last_s_ = 0;
  double max_gap_s_ = 0;
  double last_state_s_ = 0, max_state_gap_s_ = 0;
  double max_tip_depth_m_ = 0;
  std::vector<double> intervals_s_;
  std::vector<double> draw_times_s_;
  std::vector<double> sync_times_s_;
  double sync_total_s_ = 0;
  double max_servers_apart_s_ = 0;
};

// For each body "yes", "no", or "unknown": at the session's end, or else when a server last told its version.
std::vector<std::string> equals_server(const std::vector<BodyVersion>& versions, const std::optional<SessionEnd>& end,
                                       const std::vector<Equality::OfBody>& so_far);

}  // namespace sectio
