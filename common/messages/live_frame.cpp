#include "common/messages/live_frame.h"

#include "common/messages/live.h"
#include "common/messages/protocol.h"

namespace sectio {

std::string live_protocol() {
  return "sectio-live-" + std::to_string(kProtocolVersion) + "." + std::to_string(kLiveVersion);
}

void append_live(LiveKind kind, std::span<const std::uint8_t> message, std::vector<std::uint8_t>& frame) {
  const auto size = static_cast<std::uint32_t>(message.size());
  for (int shift = 0; shift < 32; shift += 8) frame.push_back(static_cast<std::uint8_t>(size >> shift));
  frame.push_back(static_cast<std::uint8_t>(kind));
  frame.insert(frame.end(), message.begin(), message.end());
}

std::optional<LiveFrameReader::Message> LiveFrameReader::next() {
  if (rest_.empty() || damaged_) return std::nullopt;
  damaged_ = true;
  if (rest_.size() < kLiveHeaderBytes) return std::nullopt;
  std::uint32_t size = 0;
  for (std::size_t i = 0; i < 4; ++i) size |= std::uint32_t{rest_[i]} << (8 * i);
  if (size > rest_.size() - kLiveHeaderBytes) return std::nullopt;
  damaged_ = false;
  const Message message{static_cast<LiveKind>(rest_[4]), rest_.subspan(kLiveHeaderBytes, size)};
  rest_ = rest_.subspan(kLiveHeaderBytes + size);
  return message;
}

}  // namespace sectio
