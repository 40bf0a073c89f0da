#include "sim_server/net/keyframe_server.h"

#include <algorithm>
#include <utility>

#include "common/core/log.h"
#include "common/core/wall_time.h"
#include "common/delta/keyframe.h"
#include "common/messages/chunks.h"

namespace sectio {

namespace {

using Seconds = std::chrono::duration<double>;

constexpr std::size_t kChunksPerRound = 16;  // between two looks into the outbox: 0.5 MB; off host 18 kB
constexpr std::size_t kMostWindows = 512;    // for each program
constexpr std::size_t kMostAskers = 64;
constexpr std::size_t kMostServed = 64;
constexpr double kServed_s = 5;         // after the last request for it
constexpr double kChunkRepeat_s = 0.3;  // several viewers ask for the same chunks at once, and all hear the answer
constexpr double kBurstBytes = 32e3;

}  // namespace

KeyframeServer::KeyframeServer(std::uint64_t epoch, bool off_host)
    : epoch_(epoch), off_host_(off_host), bytes_(kMostBytes_per_s, kBurstBytes) {}

KeyframeServer::Served* KeyframeServer::find(std::uint32_t body_id, std::uint64_t revision) {
  const auto at = std::ranges::find_if(
      served_, [&](const Served& each) { return each.body_id == body_id && each.revision == revision; });
  return at == served_.end() ? nullptr : &*at;
}

void KeyframeServer::forget_old() {
  const Clock::time_point now = Clock::now();
  std::erase_if(served_, [&](const Served& each) { return Seconds(now - each.asked).count() > kServed_s; });
  if (served_.size() >= kMostServed) served_.erase(std::ranges::min_element(served_, {}, &Served::asked));
}

bool KeyframeServer::begin(std::uint32_t body_id, const TriangleMesh& mesh) {
  Served* known = find(body_id, mesh.revision());
  if (known == nullptr) {
    for (const Served& each : served_)
      if (each.body_id == body_id && Seconds(Clock::now() - each.begun).count() < kInterval_s) return false;
    const std::vector<std::uint8_t> bytes = to_bytes(keyframe_of(mesh));
    if (bytes.size() > kMaxKeyframeBytes) {
      log_limited(LogLevel::error, "keyframe", "a body is too large for a keyframe: late joiners can't see it");
      return true;
    }
    forget_old();
    known = &served_.emplace_back(Served{body_id, mesh.revision(), {}, Clock::now(), {}});
    const std::uint32_t chunk_bytes = off_host_ ? kChunkBytesOffHost : kChunkBytes;
    for (KeyframeChunk& chunk : split_keyframe(epoch_, body_id, mesh.revision(), bytes, chunk_bytes))
      known->chunks.push_back({std::move(chunk), {}});
  }
  KeyframeRequest first;
  first.body_id = body_id;
  first.revision = mesh.revision();
  return go_on(first, {});  // in the name of no program, because several may wait for it
}

KeyframeServer::Asker* KeyframeServer::asker_of(const ProgramId& program) {
  const auto known = std::ranges::find(askers_, program, &Asker::program);
  if (known != askers_.end()) return &*known;
  return askers_.size() < kMostAskers ? &askers_.emplace_back(Asker{program, {}}) : nullptr;
}

bool KeyframeServer::go_on(const KeyframeRequest& request, const ProgramId& program) {
  Served* served = find(request.body_id, request.revision);
  Asker* asker = served ? asker_of(program) : nullptr;
  if (asker == nullptr || asker->windows.size() >= kMostWindows) return false;
  served->asked = Clock::now();
  const auto total = static_cast<std::uint32_t>(served->chunks.size());
  const std::uint32_t first = std::min(request.first_chunk, total);
  asker->windows.push_back({request.body_id, request.revision, first, first + std::min(request.chunks, total - first)});
  return true;
}

bool KeyframeServer::may_send(std::size_t bytes) {
  if (!off_host_) return true;
  if (!bytes_.is_open(steady_now_s())) return false;
  bytes_.take(static_cast<double>(bytes));
  return true;
}

// The next one that hasn't gone out lately; null: there is none any more.
KeyframeServer::Chunk* KeyframeServer::next_chunk(Asker& asker) {
  for (; !asker.windows.empty(); asker.windows.pop_front()) {
    Window& window = asker.windows.front();
    Served* served = find(window.body_id, window.revision);
    if (served == nullptr) continue;
    for (; window.next < window.end; ++window.next) {
      Chunk& chunk = served->chunks[window.next];
      if (Seconds(Clock::now() - chunk.sent).count() > kChunkRepeat_s) return &chunk;
    }
  }
  return nullptr;
}

std::vector<std::uint32_t> KeyframeServer::send_chunks(const std::function<bool(const KeyframeChunk&)>& write) {
  std::vector<std::uint32_t> complete;
  for (std::size_t i = 0; i < kChunksPerRound && !askers_.empty();) {
    Chunk* next = next_chunk(askers_.front());
    if (next == nullptr) {
      askers_.pop_front();
      continue;
    }
    if (!may_send(next->chunk.bytes.size())) break;
    if (write(next->chunk)) next->sent = sent_ = Clock::now();
    ++i;
    ++askers_.front().windows.front().next;
    if (next->chunk.chunk + 1 == next->chunk.chunks) complete.push_back(next->chunk.body_id);
    std::rotate(askers_.begin(), askers_.begin() + 1, askers_.end());
  }
  return complete;
}

}  // namespace sectio
