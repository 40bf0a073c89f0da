// One direction of a link between a host and a switch, as a queue of frames: rate, delay, jitter, reordering and loss.
// Knows no socket; time is passed in and ascends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "tests/support/random.h"

namespace sectio::test {

struct Link {
  double rate_bit_per_s = 0;  // 0: no limit
  double delay_s = 0;
  double jitter_s = 0;                  // added to the delay or taken from it, evenly spread
  bool reorders = false;                // a frame with a shorter delay overtakes those before it
  double loss = 0;                      // probability of each frame
  std::size_t queue_bytes = 256 << 10;  // bytes that wait for a limited rate; more are dropped
};

using EthernetFrame = std::vector<std::uint8_t>;

struct LinkTraffic {
  std::uint64_t frames = 0, bytes = 0;  // offered
  std::uint64_t dropped = 0;            // because the queue was full
  std::uint64_t lost = 0;               // by chance
  std::uint64_t expedited = 0;          // marked for expedited forwarding
};

class LinkQueue {
 public:
  explicit LinkQueue(const Link& link, std::uint32_t seed = 1) : link_(link), random_(seed) {}

  // Frames marked for expedited forwarding (DSCP 46) leave before all others.
  void offer(EthernetFrame frame, double now_s);
  // The next frame that has arrived by now; false when there is none.
  bool take(double now_s, EthernetFrame& frame);
  // When the next call of take() may find a frame.
  std::optional<double> next_s() const;

  const LinkTraffic& traffic() const { return traffic_; }

 private:
  struct Waiting {
    double offered_s;
    EthernetFrame frame;
  };

  void send_until(double now_s);
  std::deque<Waiting>* first_to_go(double at_s);
  void send(EthernetFrame frame, double begun_s);

  Link link_;
  test::Random random_;
  std::deque<Waiting> expedited_, others_;
  std::size_t waiting_bytes_ = 0;
  double free_s_ = 0;                               // the end of the frame that is being sent
  std::multimap<double, EthernetFrame> under_way_;  // by arrival
  double last_arrival_s_ = 0;
  LinkTraffic traffic_;
};

}  // namespace sectio::test
