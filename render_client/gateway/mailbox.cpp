#include "render_client/gateway/mailbox.h"

#include <algorithm>
#include <utility>

namespace sectio {

void Mailbox::post(LiveKind kind, SharedBytes message) {
  if (ordered_bytes_ + message->size() > kMaxOrderedBytes) drop_topology();
  ordered_bytes_ += message->size();
  ordered_.push_back({kind, std::move(message)});
}

void Mailbox::post_newest(Subject subject, SharedBytes message) {
  const bool is_state = subject.kind == LiveKind::state_header;
  SharedBytes& waiting = next_round_[std::move(subject)];
  if (waiting && is_state) ++replaced_;
  waiting = std::move(message);
}

void Mailbox::drop_topology() {
  const auto is_topology = [](const Ordered& o) {
    return o.kind == LiveKind::delta || o.kind == LiveKind::keyframe_chunk;
  };
  dropped_ += std::erase_if(ordered_, is_topology);
  ordered_bytes_ = 0;
  for (const Ordered& o : ordered_) ordered_bytes_ += o.message->size();  // no keyframe is left
  // Events alone never are so many, unless a client reads nothing at all.
  while (ordered_bytes_ > kMaxOrderedBytes / 2) {
    ordered_bytes_ -= ordered_.front().message->size();
    ordered_.pop_front();
  }
}

bool Mailbox::holds_keyframe(std::uint64_t epoch, std::uint32_t body_id) const {
  return std::any_of(ordered_.begin(), ordered_.end(), [&](const Ordered& o) {
    return o.kind == LiveKind::keyframe_chunk && o.epoch == epoch && o.body_id == body_id;
  });
}

// A keyframe may be larger than the bound on what waits in order: there is never more than one of a body.
void Mailbox::post_keyframe(std::uint64_t epoch, std::uint32_t body_id, const std::vector<SharedBytes>& chunks) {
  for (const SharedBytes& chunk : chunks) ordered_.push_back({LiveKind::keyframe_chunk, chunk, epoch, body_id});
}

bool Mailbox::take(std::vector<std::uint8_t>& frame) {
  frame.clear();
  const auto fits = [&](const SharedBytes& message) {
    return frame.empty() || frame.size() + kLiveHeaderBytes + message->size() <= kFrameBytes;
  };
  while (!ordered_.empty() && fits(ordered_.front().message)) {
    const Ordered& first = ordered_.front();
    append_live(first.kind, *first.message, frame);
    if (first.kind != LiveKind::keyframe_chunk) ordered_bytes_ -= first.message->size();
    ordered_.pop_front();
  }
  if (!ordered_.empty()) return true;
  if (round_.empty()) std::swap(round_, next_round_);
  while (!round_.empty() && fits(round_.begin()->second)) {
    append_live(round_.begin()->first.kind, *round_.begin()->second, frame);
    round_.erase(round_.begin());
  }
  return !frame.empty();
}

}  // namespace sectio
