// A client of the gateway that writes any bytes it likes to its socket: what a browser can't do. Each call blocks as
// long as it is told at most.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/messages/codec.h"
#include "common/messages/live.h"
#include "common/messages/live_frame.h"
#include "common/messages/state.h"
#include "common/messages/tool.h"

namespace sectio::test {

class WebPeer {
 public:
  // Connects to 127.0.0.1, and says nothing.
  explicit WebPeer(int port);
  // With a handshake.
  WebPeer(int port, const Hello& hello);
  ~WebPeer();
  WebPeer(const WebPeer&) = delete;
  WebPeer& operator=(const WebPeer&) = delete;

  void shake_hands();
  // Bytes as they are; false once the other side has closed.
  bool send_raw(const std::string& bytes);
  // The beginning of a WebSocket message that is to have so many bytes.
  static std::string header(std::uint64_t size_bytes, bool is_last = true);

  template <class Message>
  bool say(LiveKind kind, const Message& message) {
    std::vector<std::uint8_t> frame;
    append_live(kind, encode(message), frame);
    return send_raw(header(frame.size()) + std::string(frame.begin(), frame.end()));
  }
  bool wish(std::uint32_t tool, const Vec3& at_m) {
    return say(LiveKind::wish, ToolWish{0, tool, ++sequence_, JointPose{Pose{at_m}}, true});
  }

  // Reads what has come; false once the other side has closed.
  bool read(std::chrono::milliseconds time = std::chrono::milliseconds(0));
  // Reads so many bytes at most.
  bool read_little(std::size_t most_bytes);
  // Reads, and does `meanwhile` again and again, until the condition holds. False after a minute, or at the end.
  bool wait_until(const std::function<bool()>& condition, const std::function<void()>& meanwhile = {});
  // Whether the other side closes the connection.
  bool is_closed_in(std::chrono::seconds time);

  // News that have come so far.
  std::uint32_t holder(std::uint32_t tool) const;
  std::uint32_t own_id() const { return roster.you; }
  bool was_told(const std::string& text) const;
  Roster roster;
  std::optional<StateHeader> state;
  std::optional<SceneInfo> scene;
  std::vector<std::string> notices;
  std::size_t states = 0;
  std::size_t pings = 0;  // each has been answered, as a browser does
  std::string goodbye;    // the reason with which the connection was closed

 private:
  void take_frames();
  void answer(const std::string& ping);
  void take(const std::vector<std::uint8_t>& frame);

  int socket_ = -1;
  bool is_closed_ = false;
  std::uint64_t sequence_ = 0;
  std::string incoming_;
  std::vector<std::uint8_t> message_;
};

}  // namespace sectio::test
