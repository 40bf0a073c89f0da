// A frame of the WebSocket between gateway and page: messages one behind the other. Each is its length in bytes
// (uint32, little-endian), its kind (a byte), and its bytes as codec.h makes them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace sectio {

enum class LiveKind : std::uint8_t {
  // gateway to page
  scene = 1,
  delta,
  keyframe_chunk,
  state_header,
  state_piece,
  scalar_piece,
  event,
  status,
  contact,
  session_end,
  roster,
  notice,
  // page to gateway
  hello = 64,
  claim,
  wish,
  keyframe_request,
  order,
};

constexpr std::size_t kLiveHeaderBytes = 5;

void append_live(LiveKind kind, std::span<const std::uint8_t> message, std::vector<std::uint8_t>& frame);

// The messages of a frame, in order:
//
//   LiveFrameReader reader(frame);
//   while (const auto message = reader.next()) ...
//   if (reader.damaged()) ...
class LiveFrameReader {
 public:
  struct Message {
    LiveKind kind;  // any number, if a stranger wrote it
    std::span<const std::uint8_t> bytes;
  };

  explicit LiveFrameReader(std::span<const std::uint8_t> frame) : rest_(frame) {}

  std::optional<Message> next();
  bool damaged() const { return damaged_; }  // the rest is no message

 private:
  std::span<const std::uint8_t> rest_;
  bool damaged_ = false;
};

}  // namespace sectio
