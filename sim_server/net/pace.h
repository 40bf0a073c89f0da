// The speed of a session, set by its leader: paused, or a multiple of real time.
#pragma once

#include <optional>
#include <string>

#include "common/messages/session.h"
#include "sim_server/world/step_io.h"

namespace sectio {

class Pace {
 public:
  explicit Pace(double speed) : speed_(speed) {}

  double speed() const { return speed_; }  // speed while the session is not paused
  bool is_paused() const { return is_paused_; }
  double now() const { return is_paused_ ? 0 : speed_; }

  void pause() { is_paused_ = true; }

  struct News {
    EventKind kind;
    std::string text;
  };
  // Takes over what an order says of the pace. Nothing: the order says nothing of it, or no other than before.
  std::optional<News> take(const SessionOrder& order);

 private:
  double speed_;
  bool is_paused_ = false;
};

}  // namespace sectio
