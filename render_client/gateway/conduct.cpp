#include "render_client/gateway/conduct.h"

#include <algorithm>

namespace sectio {

void Conduct::refusal(double now_s, double weight) {
  refused_ = std::max(0.0, refused_ - kForgiven_per_s * (now_s - refused_s_)) + weight;
  refused_s_ = now_s;
}

void Conduct::tick(double now_s) {
  if (came_s_ < 0) came_s_ = now_s;
  is_silent_ = !has_spoken_ && now_s - came_s_ > kSilence_s;
}

const char* Conduct::fault() const {
  if (is_silent_) return "has said nothing for 10 s";
  if (garbage_ >= kMaxGarbage) return "has sent 16 messages that are none";
  if (refused_ > kMaxRefused) return "goes on with what was refused: instruments of others, orders, tokens";
  if (too_fast_ >= kMaxTooFast) return "has moved an instrument beyond the limit of speed 100 times in a row";
  return nullptr;
}

}  // namespace sectio
