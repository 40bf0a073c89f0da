#include "render_client/net/link_meter.h"

#include <algorithm>
#include <bit>

namespace sectio {

namespace {

constexpr std::size_t kMaxServers = 64;
constexpr double kStatesInKeyframe = 8;  // bytes of a keyframe over those of a state in which all vertices move
constexpr double kSilent_s = 1;          // beyond a few intervals: the link is full, or the server has nothing to say
constexpr double kSettle_s = 1;          // after a change, until the queue that led to it is empty

}  // namespace

void LinkMeter::hear(double now_s, const StateHeader& header) {
  if (least_delay_s_.size() > kMaxServers) least_delay_s_.clear();
  const double delay_s = now_s - header.sent_s;
  double& least_s = least_delay_s_.try_emplace(header.epoch, delay_s).first->second;
  least_s = std::min(least_s, delay_s);
  window_late_s_ = std::min(window_late_s_, delay_s - least_s);
  ++window_headers_;
  if (clock_offset_s_) delays_.add(delay_s);
  heard_s_ = now_s;
  for (const BodyState& body : header.bodies)
    for (const std::uint8_t bits : body.pieces_sent) window_named_ += static_cast<unsigned>(std::popcount(bits));
}

void LinkMeter::hear(const StatePiece&) {
  ++window_came_;
}

void LinkMeter::measure(double now_s) {
  const double span_s = std::max(1e-3, now_s - window_began_s_);
  report_.rate_hz = kStateRates_hz[level_];
  report_.came_per_s = window_headers_ / span_s;
  report_.late_s = window_headers_ > 0 ? window_late_s_ : 0;
  report_.lost_fraction =
      window_named_ > window_came_ ? 1 - static_cast<double>(window_came_) / static_cast<double>(window_named_) : 0;
  if (clock_offset_s_) delays_.take(report_, *clock_offset_s_);
  window_began_s_ = now_s;
  window_late_s_ = 1e300;
  window_headers_ = 0;
  window_named_ = window_came_ = 0;
}

void LinkMeter::change_to(std::size_t level, double now_s) {
  if (level > level_ && now_s - tried_s_ < 4 * kSettle_s) patience_s_ = std::min(2 * patience_s_, kMostPatience_s);
  if (level < level_) tried_s_ = now_s;
  level_ = level;
  changed_s_ = now_s;
  prompt_since_s_ = -1;
}

void LinkMeter::begin(double keyframes_took_s) {
  for (level_ = 1; level_ + 1 < kStateRates_hz.size(); ++level_)
    if (kStateRates_hz[level_] * keyframes_took_s <= kStatesInKeyframe) break;
}

std::size_t LinkMeter::choose(double now_s) {
  if (heard_s_ < 0) return level_;
  if (window_began_s_ < 0) {  // states heard before had another rate
    measure(now_s);
    changed_s_ = now_s;
  }
  const double window_s = std::max(kWindow_s, 2 / kStateRates_hz[level_]);
  if (now_s - window_began_s_ < window_s) return level_;
  const bool heard = window_headers_ > 0;
  measure(now_s);
  const bool settled = now_s - changed_s_ >= kSettle_s;
  const bool late = heard ? report_.late_s > kLate_s : now_s - heard_s_ > kSilent_s + 3 / kStateRates_hz[level_];
  const bool prompt = heard && report_.late_s < kPrompt_s;
  if (late && settled && level_ + 1 < kStateRates_hz.size()) {
    if (!heard) heard_s_ = now_s;  // one step at a time, though nothing comes
    change_to(level_ + 1, now_s);
  } else if (!prompt) {
    prompt_since_s_ = -1;
  } else if (prompt_since_s_ < 0) {
    prompt_since_s_ = now_s;
  } else if (settled && level_ > 0 && now_s - prompt_since_s_ >= patience_s_) {
    change_to(level_ - 1, now_s);
  }
  return level_;
}

}  // namespace sectio
