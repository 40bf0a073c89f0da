// A program's link to its server: what it reports, in words, and the two clocks at its ends.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "common/messages/session.h"

namespace sectio {

// One line for a person.
std::string line_of(const LinkReport& report);

// How long messages take to the server and back, and by how much the server's clock is ahead of the program. The
// server tells with its status when it heard the program's last report; the exchange that took the least time says most
// about the clocks, as in the Network Time Protocol. One thread.
class LinkClock {
 public:
  // `client`: the number in this program's reports.
  void hear(double now_s, std::uint64_t client, const ServerStatus& status);

  bool known() const { return !exchanges_.empty(); }
  double round_trip_s() const { return best().round_trip_s; }
  double offset_s() const { return best().offset_s; }  // server clock minus program clock
  // Fills in the round trip, the offset of the clocks, and the time.
  void stamp(double now_s, LinkReport& report) const;

 private:
  static constexpr std::size_t kExchanges = 16;
  struct Exchange {
    double round_trip_s = 0, offset_s = 0;
  };
  Exchange best() const;

  std::deque<Exchange> exchanges_;  // the newest exchanges
};

// Durations since the last take(), and their quantiles.
class Ages {
 public:
  void add(double age_s) { ages_s_.push_back(age_s); }
  // Median and 99th percentile since the last call; as they were when there are none.
  void take(LinkReport& report, double offset_s = 0);

 private:
  std::vector<double> ages_s_;
};

}  // namespace sectio
