#include "tests/support/link_queue.h"

#include <algorithm>
#include <utility>

namespace sectio::test {

namespace {

constexpr std::size_t kEthernetHeader = 14;

bool is_ipv4(const EthernetFrame& frame) {
  return frame.size() > kEthernetHeader + 1 && frame[12] == 0x08 && frame[13] == 0x00;
}

bool is_expedited(const EthernetFrame& frame) {
  constexpr int kExpeditedForwarding = 46;  // RFC 3246
  return is_ipv4(frame) && frame[kEthernetHeader + 1] >> 2 == kExpeditedForwarding;
}

}  // namespace

void LinkQueue::offer(EthernetFrame frame, double now_s) {
  send_until(now_s);
  ++traffic_.frames;
  traffic_.bytes += frame.size();
  traffic_.expedited += is_expedited(frame);
  // The search for addresses (ARP) is spared: it would ask again after a second, which says nothing about a program.
  if (is_ipv4(frame) && std::uniform_real_distribution<double>(0, 1)(random_) < link_.loss) {
    ++traffic_.lost;
    return;
  }
  if (link_.rate_bit_per_s <= 0) return send(std::move(frame), now_s);
  if (waiting_bytes_ + frame.size() > link_.queue_bytes) {
    ++traffic_.dropped;
    return;
  }
  waiting_bytes_ += frame.size();
  auto& queue = is_expedited(frame) ? expedited_ : others_;
  queue.push_back({now_s, std::move(frame)});
}

std::deque<LinkQueue::Waiting>* LinkQueue::first_to_go(double at_s) {
  if (!expedited_.empty() && expedited_.front().offered_s <= at_s) return &expedited_;
  if (!others_.empty() && others_.front().offered_s <= at_s) return &others_;
  return nullptr;
}

void LinkQueue::send_until(double now_s) {
  while (!expedited_.empty() || !others_.empty()) {
    double begun_s = free_s_;
    std::deque<Waiting>* queue = first_to_go(begun_s);
    if (queue == nullptr) {  // the link was idle until the next frame came
      begun_s = std::min(expedited_.empty() ? 1e300 : expedited_.front().offered_s,
                         others_.empty() ? 1e300 : others_.front().offered_s);
      queue = first_to_go(begun_s);
    }
    if (begun_s > now_s) return;
    EthernetFrame frame = std::move(queue->front().frame);
    queue->pop_front();
    waiting_bytes_ -= frame.size();
    free_s_ = begun_s + 8 * static_cast<double>(frame.size()) / link_.rate_bit_per_s;
    send(std::move(frame), free_s_);
  }
}

void LinkQueue::send(EthernetFrame frame, double begun_s) {
  const double jitter_s = link_.jitter_s * std::uniform_real_distribution<double>(-1, 1)(random_);
  double arrival_s = begun_s + std::max(0.0, link_.delay_s + jitter_s);
  if (!link_.reorders) arrival_s = std::max(arrival_s, last_arrival_s_);
  last_arrival_s_ = arrival_s;
  under_way_.emplace(arrival_s, std::move(frame));
}

bool LinkQueue::take(double now_s, EthernetFrame& frame) {
  send_until(now_s);
  if (under_way_.empty() || under_way_.begin()->first > now_s) return false;
  frame = std::move(under_way_.begin()->second);
  under_way_.erase(under_way_.begin());
  return true;
}

std::optional<double> LinkQueue::next_s() const {
  std::optional<double> next;
  if (!under_way_.empty()) next = under_way_.begin()->first;
  if (!expedited_.empty() || !others_.empty()) next = std::min(next.value_or(free_s_), free_s_);
  return next;
}

}  // namespace sectio::test
