// A viewer's measure of its link, and the rate at which it wants states: as many as come through without a wait in
// queues. The server offers every state at a few rates, the slower the coarser; each viewer chooses for itself, so that
// a slow link slows nobody else down (receiver-driven layered multicast: McCanne, Jacobson & Vetterli 1996).
//
// The delay counts, not the loss: a queue that grows says that the link is full, while a link that loses at
// random may have room. A choice that turned out badly isn't tried again for twice as long as the time before.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "common/messages/link.h"
#include "common/messages/session.h"
#include "common/messages/state.h"

namespace sectio {

class LinkMeter {
 public:
  static constexpr double kWindow_s = 0.5;   // a measurement lasts this long
  static constexpr double kLate_s = 0.1;     // states this late: a slower rate is chosen
  static constexpr double kPrompt_s = 0.05;  // states this prompt: a faster rate may be tried
  static constexpr double kPatience_s = 1;   // before the first try
  static constexpr double kMostPatience_s = 60;

  // `level`: an index of kStateRates_hz to begin with.
  explicit LinkMeter(std::size_t level) : level_(level) {}

  void hear(double now_s, const StateHeader& header);
  void hear(const StatePiece& piece);
  // Sets the server clock minus this program's clock; without it, the age of states isn't known.
  void set_clock_offset(double offset_s) { clock_offset_s_ = offset_s; }

  // The rate with which to begin, on a link that took so long for the keyframes of what is to be seen.
  void begin(double keyframes_took_s);
  // The rate from now on, an index of kStateRates_hz. `now_s` ascends.
  std::size_t choose(double now_s);
  // The last window, without `client` and `name`.
  const LinkReport& report() const { return report_; }

 private:
  void measure(double now_s);
  void change_to(std::size_t level, double now_s);

  std::size_t level_;
  double changed_s_ = -1e300;
  double prompt_since_s_ = -1;
  double patience_s_ = kPatience_s;
  double tried_s_ = -1e300;  // when a faster rate was last tried

  double window_began_s_ = -1;
  double heard_s_ = -1;
  std::map<std::uint64_t, double> least_delay_s_;  // ever, by epoch: the clocks of two hosts differ
  double window_late_s_ = 1e300;
  int window_headers_ = 0;
  std::uint64_t window_named_ = 0, window_came_ = 0;
  LinkReport report_;
  Ages delays_;  // by two clocks
  std::optional<double> clock_offset_s_;
};

}  // namespace sectio
