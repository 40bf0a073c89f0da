#include "render_client/view_record.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "common/core/report_figures.h"
#include "render_client/replica/tip_depth.h"

namespace sectio {

namespace {

constexpr std::size_t kMaxTimes = 1u << 20;  // a longer session keeps the first ones

}  // namespace

void ViewRecord::add(double now_s, double draw_time_s, const Frame& frame, bool is_new) {
  if (pictures_ == 0) {
    begun_s_ = now_s;
    first_step_ = frame.step;
  } else {
    max_gap_s_ = std::max(max_gap_s_, now_s - last_s_);
    if (intervals_s_.size() < kMaxTimes) intervals_s_.push_back(now_s - last_s_);
  }
  if (draw_times_s_.size() < kMaxTimes) draw_times_s_.push_back(draw_time_s);
  last_s_ = now_s;
  ++pictures_;
  if (!is_new) return;
  if (states_ > 0) max_state_gap_s_ = std::max(max_state_gap_s_, now_s - last_state_s_);
  last_state_s_ = now_s;
  ++states_;
  last_step_ = frame.step;
  max_tip_depth_m_ = std::max(max_tip_depth_m_, visible_tip_depth_m(frame));
}

void ViewRecord::add_sync(double sync_time_s, const World& world) {
  if (sync_times_s_.size() < kMaxTimes) sync_times_s_.push_back(sync_time_s);
  sync_total_s_ += sync_time_s;
  max_servers_apart_s_ = std::max(max_servers_apart_s_, world.servers_apart_s());
}

double ViewRecord::pictures_per_s() const {
  return last_s_ > begun_s_ ? static_cast<double>(pictures_ - 1) / (last_s_ - begun_s_) : 0;
}

std::string ViewRecord::json(const std::string& name, const World& world, const ClientNetCounts& net,
                             const std::vector<BodyVersion>& versions, const std::vector<std::string>& equal) const {
  nlohmann::ordered_json report;
  report["client"] = name;
  report["session"] = world.scene() ? world.scene()->session : "";
  report["servers"] = world.servers();
  report["bodies"] = nlohmann::ordered_json::array();
  const std::vector<std::string> names = world.body_names();
  const std::vector<const ReplicaBody*> bodies = world.bodies();
  for (std::size_t b = 0; b < versions.size(); ++b)
    report["bodies"].push_back({{"name", names[b]},
                                {"revision", versions[b].revision},
                                {"topology_hash", hash_text(versions[b].topology_hash)},
                                {"equals_server", equal[b]},
                                {"copy_bytes", bodies[b]->bytes()}});
  report["frames_drawn"] = pictures_;
  report["states_drawn"] = states_;
  report["first_step"] = first_step_;
  report["last_step"] = last_step_;
  report["mean_frames_per_s"] = pictures_per_s();
  report["median_frame_time_s"] = quantile(intervals_s_, 0.5);
  report["p99_frame_time_s"] = quantile(intervals_s_, 0.99);
  report["max_gap_s"] = max_gap_s_;
  report["max_state_gap_s"] = max_state_gap_s_;
  report["median_draw_time_s"] = quantile(draw_times_s_, 0.5);
  report["p99_draw_time_s"] = quantile(draw_times_s_, 0.99);
  report["max_visible_tip_depth_m"] = max_tip_depth_m_;
  report["copy_bytes"] = world.bytes();
  report["median_sync_time_s"] = quantile(sync_times_s_, 0.5);
  report["p99_sync_time_s"] = quantile(sync_times_s_, 0.99);
  report["total_sync_time_s"] = sync_total_s_;
  report["max_servers_apart_s"] = max_servers_apart_s_;
  const ReplicaCounts counts = world.counts();
  report["deltas_applied"] = counts.deltas_applied;
  report["resyncs"] = counts.resyncs;
  report["keyframes_requested"] = counts.requests;
  report["hash_mismatches"] = counts.hash_mismatches;
  report["frames_with_older_pieces"] = counts.patched_frames;
  report["messages"] = net.messages;
  report["messages_damaged"] = net.damaged;
  return report.dump(2) + "\n";
}

std::vector<std::string> equals_server(const std::vector<BodyVersion>& versions, const std::optional<SessionEnd>& end,
                                       const std::vector<Equality::OfBody>& so_far) {
  std::vector<std::string> words;
  for (std::size_t b = 0; b < versions.size(); ++b) {
    std::optional<bool> equal;
    if (b < so_far.size() && so_far[b].revision == versions[b].revision) equal = so_far[b].equal;
    if (end && b < end->bodies.size()) equal = versions[b] == end->bodies[b];
    words.emplace_back(!equal ? "unknown" : *equal ? "yes" : "no");
  }
  return words;
}

}  // namespace sectio
