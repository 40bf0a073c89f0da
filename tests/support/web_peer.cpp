#include "tests/support/web_peer.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>

namespace sectio::test {
namespace {

constexpr std::chrono::seconds kLongest{60};
constexpr std::chrono::milliseconds kTurn{10};
constexpr unsigned kBinary = 2, kClose = 8, kPing = 9, kPong = 10, kMasked = 0x80, kFinal = 0x80;

std::uint64_t number(const std::string& bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8 | static_cast<std::uint8_t>(bytes[at + i]);
  return value;
}

}  // namespace

WebPeer::WebPeer(int port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("no connection to port " + std::to_string(port));
}

WebPeer::WebPeer(int port, const Hello& hello) : WebPeer(port) {
  shake_hands();
  say(LiveKind::hello, hello);
}

WebPeer::~WebPeer() {
  close(socket_);
}

void WebPeer::shake_hands() {
  send_raw("GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: " +
           std::string("dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: ") +
           live_protocol() + "\r\n\r\n");
  char byte = 0;
  std::string answer;
  while (!answer.ends_with("\r\n\r\n") && recv(socket_, &byte, 1, 0) == 1) answer += byte;
  if (!answer.starts_with("HTTP/1.1 101")) is_closed_ = true;
}

bool WebPeer::send_raw(const std::string& bytes) {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t size = send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (size <= 0) return false;
    sent += static_cast<std::size_t>(size);
  }
  return true;
}

// The key is zero, so that the message stands as it is.
std::string WebPeer::header(std::uint64_t size_bytes, bool is_last) {
  std::string text{static_cast<char>(kBinary | (is_last ? kFinal : 0)), static_cast<char>(kMasked | 127)};
  for (int shift = 56; shift >= 0; shift -= 8) text += static_cast<char>(size_bytes >> shift & 0xff);
  return text + std::string(4, '\0');
}

bool WebPeer::read(std::chrono::milliseconds time) {
  pollfd ready{socket_, POLLIN, 0};
  for (auto left = time; !is_closed_ && poll(&ready, 1, static_cast<int>(left.count())) > 0; left = {})
    read_little(1 << 16);
  return !is_closed_;
}

bool WebPeer::read_little(std::size_t most_bytes) {
  std::string bytes(most_bytes, '\0');
  const ssize_t size = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
  is_closed_ = is_closed_ || size == 0 || (size < 0 && errno != EAGAIN);
  if (size > 0) incoming_.append(bytes, 0, static_cast<std::size_t>(size));
  take_frames();
  return !is_closed_;
}

bool WebPeer::wait_until(const std::function<bool()>& condition, const std::function<void()>& meanwhile) {
  for (const auto end = std::chrono::steady_clock::now() + kLongest; !condition();) {
    if (!read(kTurn)) return condition();
    if (meanwhile) meanwhile();
    if (std::chrono::steady_clock::now() > end) return false;
  }
  return true;
}

bool WebPeer::is_closed_in(std::chrono::seconds time) {
  for (const auto end = std::chrono::steady_clock::now() + time; std::chrono::steady_clock::now() < end;)
    if (!read(kTurn)) return true;
  return false;
}

// The gateway masks nothing.
void WebPeer::take_frames() {
  std::size_t at = 0;
  while (incoming_.size() >= at + 10) {
    const unsigned first = static_cast<std::uint8_t>(incoming_[at]);
    std::uint64_t size = static_cast<std::uint8_t>(incoming_[at + 1]);
    std::size_t begin = at + 2;
    if (size >= 126) {
      const std::size_t width = size == 126 ? 2 : 8;
      size = number(incoming_, begin, width);
      begin += width;
    }
    if (incoming_.size() - begin < size) break;
    const std::string part = incoming_.substr(begin, size);
    at = begin + size;
    if ((first & 0xf) == kClose) goodbye = part.size() > 2 ? part.substr(2) : "";
    if ((first & 0xf) == kPing) answer(part);
    if ((first & 0xf) > kBinary) continue;
    message_.insert(message_.end(), part.begin(), part.end());
    if ((first & kFinal) != 0) take(std::exchange(message_, {}));
  }
  incoming_.erase(0, at);
}

void WebPeer::answer(const std::string& ping) {
  ++pings;
  send_raw({static_cast<char>(kPong | kFinal), static_cast<char>(kMasked | ping.size())});
  send_raw(std::string(4, '\0') + ping);
}

void WebPeer::take(const std::vector<std::uint8_t>& frame) {
  LiveFrameReader reader(frame);
  while (const auto message = reader.next()) {
    if (message->kind == LiveKind::scene) scene = decode<SceneInfo>(message->bytes);
    if (message->kind == LiveKind::notice) notices.push_back(decode<Notice>(message->bytes)->text);
    if (message->kind == LiveKind::roster) roster = *decode<Roster>(message->bytes);
    if (message->kind != LiveKind::state_header) continue;
    state = decode<StateHeader>(message->bytes);
    ++states;
  }
}

std::uint32_t WebPeer::holder(std::uint32_t tool) const {
  return tool < roster.holders.size() ? roster.holders[tool] : kNobody;
}

bool WebPeer::was_told(const std::string& text) const {
  return std::ranges::any_of(notices, [&](const std::string& each) { return each.find(text) != std::string::npos; });
}

}  // namespace sectio::test
