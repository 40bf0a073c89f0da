// How fast a session goes on, as those say who lead it: paused, or so many times as fast as the clock.
#pragma once

#include <optional>
#include <string>

#include "common/messages/session.h"
#include "sim_server/step/step_io.h"

namespace sectio {

class Pace {
 public:
  explicit Pace(double speed) : speed_(speed) {}

  double speed() const { return speed_; }  // when it goes on
  bool is_paused() const { return is_paused_; }
  double now() const { return is_paused_ ? 0 : speed_; }

  struct News {
    EventKind kind;
    std::string text;
  };
  // Takes what an order says of it. Nothing: the order says nothing, or what was so before.
  std::optional<News> take(const SessionOrder& order);

 private:
  double speed_;
  bool is_paused_ = false;
};

}  // namespace sectio
