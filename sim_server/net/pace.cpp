#include "sim_server/net/pace.h"

#include <utility>

#include "common/core/formatted.h"

namespace sectio {

std::optional<Pace::News> Pace::take(const SessionOrder& order) {
  switch (order.kind) {
    case OrderKind::pause:
      if (std::exchange(is_paused_, true)) return std::nullopt;
      return News{EventKind::paused, "paused"};
    case OrderKind::go_on:
      if (!std::exchange(is_paused_, false)) return std::nullopt;
      return News{EventKind::went_on, "the session goes on"};
    case OrderKind::set_speed:
      speed_ = order.speed;
      return News{EventKind::speed_set, formatted("the session runs at %.3g times the clock", speed_)};
    default:
      return std::nullopt;
  }
}

}  // namespace sectio
