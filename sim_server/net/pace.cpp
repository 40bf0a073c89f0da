#include "sim_server/net/pace.h"

#include <cstdio>
#include <utility>

namespace sectio {

std::optional<Pace::News> Pace::take(const SessionOrder& order) {
  char text[64];
  switch (order.kind) {
    case OrderKind::pause:
      if (std::exchange(is_paused_, true)) return std::nullopt;
      return News{EventKind::paused, "paused"};
    case OrderKind::go_on:
      if (!std::exchange(is_paused_, false)) return std::nullopt;
      return News{EventKind::went_on, "the session goes on"};
    case OrderKind::set_speed:
      speed_ = order.speed;
      std::snprintf(text, sizeof text, "the session runs at %.3g times the clock", speed_);
      return News{EventKind::speed_set, text};
    default:
      return std::nullopt;
  }
}

}  // namespace sectio
