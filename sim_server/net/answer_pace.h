// The choice of contact models that a hand gets: those that answer another pose than the one before, or tell of another
// state. A hand that sends few poses, since its link is thin, gets no more answers than it has asked for.
#pragma once

#include <cstdint>
#include <map>

#include "common/math/contact_model.h"

namespace sectio {

class AnswerPace {
 public:
  static constexpr double kLongest_s = 0.02;  // tissue moves beneath a hand that rests, or says nothing

  // Numbers the models of a tool that are due: a hand counts by them what was lost. `now_s`: any steady clock.
  bool take(ContactModel& model, double now_s) {
    const auto [sent, is_first] = sent_.try_emplace(model.tool_id);
    Sent& last = sent->second;
    const bool is_due = is_first || model.tool_time_s != last.tool_time_s || model.state != last.state ||
                        now_s - last.at_s >= kLongest_s;
    if (is_due) last = {model.tool_time_s, now_s, model.state, model.sequence = last.sequence + 1};
    return is_due;
  }

 private:
  struct Sent {
    double tool_time_s = 0, at_s = 0;
    ContactState state = ContactState::free;
    std::uint64_t sequence = 0;
  };
  std::map<std::uint32_t, Sent> sent_;
};

}  // namespace sectio
