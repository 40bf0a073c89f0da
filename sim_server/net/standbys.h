// The programs that stand by for servers, as each of them knows the others: all hear what all ask for, so that all
// agree on their order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/messages/epoch.h"

namespace sectio {

class Standbys {
 public:
  static constexpr std::size_t kMost = 64;
  static constexpr double kPresence_s = 0.5;  // one that has asked for nothing for longer has gone

  // The program asks for steps of a server with this epoch; 0: of any, since it has not heard one yet. `now_s`: any
  // steady clock, here and below.
  void hear(const ProgramId& program, std::uint64_t epoch, double now_s) {
    std::erase_if(known_, [&](const Known& each) { return each.program == program; });
    if (known_.size() >= kMost) known_.erase(known_.begin());
    known_.push_back({program, epoch, now_s});
  }
  bool has_heard(const ProgramId& program) const {
    return std::any_of(known_.begin(), known_.end(), [&](const Known& each) { return each.program == program; });
  }
  std::size_t count(double now_s) const {
    return static_cast<std::size_t>(
        std::count_if(known_.begin(), known_.end(), [&](const Known& each) { return is_there(each, now_s); }));
  }
  // How many that are there go on with the session of this epoch rather than `own`.
  std::size_t before(const ProgramId& own, std::uint64_t epoch, double now_s) const {
    return static_cast<std::size_t>(std::count_if(known_.begin(), known_.end(), [&](const Known& each) {
      return each.program < own && same_session(each.epoch, epoch) && is_there(each, now_s);
    }));
  }

 private:
  struct Known {
    ProgramId program;
    std::uint64_t epoch = 0;
    double heard_s = 0;
  };
  static bool is_there(const Known& each, double now_s) { return now_s - each.heard_s <= kPresence_s; }
  std::vector<Known> known_;  // the one heard last at the end
};

}  // namespace sectio
