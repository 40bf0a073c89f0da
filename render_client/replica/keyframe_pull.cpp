#include "render_client/replica/keyframe_pull.h"

#include <algorithm>
#include <utility>

namespace sectio {

namespace {

constexpr double kFast_s = 0.1;  // half of a window
constexpr double kSlow_s = 0.3;

}  // namespace

std::optional<std::vector<std::uint8_t>> KeyframePull::add(KeyframeChunk chunk) {
  const std::uint32_t body_id = chunk.body_id;
  const auto known = pulls_.find(body_id);
  if (known != pulls_.end() && known->second.revision != chunk.revision) return std::nullopt;
  const bool full = assembler_.bytes() + chunk.bytes.size() > kMaxKeyframeBytes;
  if (full || (known == pulls_.end() && pulls_.size() >= kMaxBodies)) return std::nullopt;
  Pull& pull = pulls_[body_id];
  pull.revision = chunk.revision;
  pull.total = chunk.chunks;
  pull.chunk_bytes = std::max(pull.chunk_bytes, chunk.bytes.size());
  pull.came_s = -1;
  ++pull.came;
  auto whole = assembler_.add(std::move(chunk));
  if (whole || !assembler_.has(body_id)) pulls_.erase(body_id);
  return whole;
}

void KeyframePull::widen_or_narrow(Pull& pull, double now_s) {
  const double took_s = now_s - pull.asked_s;
  const auto most = static_cast<std::uint32_t>(std::clamp<std::size_t>(
      kMostWindowBytes / std::max<std::size_t>(1, pull.chunk_bytes), kFirstWindow, kMostWindow));
  if (took_s < kFast_s) pull.window = std::min(2 * pull.window, most);
  if (took_s > kSlow_s) pull.window = std::max(pull.window / 2, kFirstWindow);
}

std::vector<KeyframeRequest> KeyframePull::take_requests(double now_s,
                                                         const std::function<bool(std::uint32_t)>& wanted) {
  std::vector<KeyframeRequest> requests;
  for (auto at = pulls_.begin(); at != pulls_.end();) {
    auto& [body_id, pull] = *at;
    if (pull.came_s < 0) pull.came_s = now_s, pull.stalls = 0;
    if (pull.asked_s < 0) pull.asked_s = now_s;
    const bool stalled = now_s - pull.came_s > kStall_s * (1 + pull.stalls);
    if (stalled && (++pull.stalls > 1 || !wanted(body_id))) {
      assembler_.forget(body_id);
      at = pulls_.erase(at);
      continue;
    }
    const std::uint32_t first = stalled ? assembler_.first_missing(body_id) : pull.asked;
    const bool half_came = pull.came + pull.window / 2 >= pull.asked;
    if (wanted(body_id) && first < pull.total && (stalled || half_came)) {
      if (stalled)
        pull.window = kFirstWindow;
      else
        widen_or_narrow(pull, now_s);
      KeyframeRequest request;
      request.body_id = body_id;
      request.revision = pull.revision;
      request.first_chunk = first;
      request.chunks = std::min(pull.window, pull.total - first);
      pull.asked = std::max(pull.asked, first + request.chunks);
      pull.asked_s = now_s;
      requests.push_back(request);
    }
    ++at;
  }
  return requests;
}

std::vector<KeyframeRequest> keyframe_requests(Replica& replica, KeyframePull& pull, double now_s) {
  std::vector<KeyframeRequest> requests = replica.take_requests(now_s);
  std::erase_if(requests, [&](const KeyframeRequest& request) { return pull.is_coming(request.body_id); });
  const auto wanted = [&](std::uint32_t body_id) { return replica.wants_keyframe(body_id); };
  for (KeyframeRequest& request : pull.take_requests(now_s, wanted)) {
    request.epoch = replica.scene()->epoch;
    requests.push_back(request);
  }
  return requests;
}

}  // namespace sectio
