// A program that slept joins its session anew.
#pragma once

#include <exception>
#include <memory>
#include <string>
#include <utility>

#include "common/core/log.h"
#include "common/dds/participant.h"

namespace sectio {

// A seat is a program's `participant` with its endpoints. Puts the one that make() returns in place of one that has
// overslept, and returns that; where none can be made now it stays, and the next call tries again.
template <class Seat, class Make>
std::unique_ptr<Seat> renew_after_sleep(std::unique_ptr<Seat>& seat, const Make& make) {
  if (!seat->participant.overslept()) return nullptr;
  try {
    std::unique_ptr<Seat> former = std::exchange(seat, make());
    log_info("was asleep: joining the session anew");
    return former;
  } catch (const std::exception& error) {
    log_limited(LogLevel::warning, "renew",
                std::string("was asleep, and can't join the session anew: ") + error.what());
    return nullptr;
  }
}

}  // namespace sectio
