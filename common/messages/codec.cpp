#include "common/messages/codec.h"

#include <cmath>
#include <cstring>

#include "common/messages/inputs_fields.h"
#include "common/messages/live_fields.h"
#include "common/messages/session_fields.h"
#include "common/messages/state_fields.h"
#include "common/messages/tool_fields.h"
#include "common/messages/topology_fields.h"
#include "common/messages/validate.h"
#include "common/messages/visit.h"

namespace sectio {
namespace {

// In front of every message: plain CDR, little-endian, no options. Alignment counts from its end.
constexpr std::uint8_t kEncapsulation[4] = {0, 1, 0, 0};
constexpr std::size_t kMostPadding = 3;  // a carrier may leave so many bytes behind a message

std::size_t padding(std::size_t at, std::size_t size) {
  return (size - (at - sizeof kEncapsulation) % size) % size;
}

class CdrWriter {
 public:
  CdrWriter() : bytes_(std::begin(kEncapsulation), std::end(kEncapsulation)) {}

  template <class T, class... Limits>
  void operator()(const char*, const T& value, Limits...) {
    put(value);
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  template <visit::Number T>
  void put_all(const T* values, std::size_t count) {
    if (count == 0) return;
    bytes_.resize(bytes_.size() + padding(bytes_.size(), sizeof(T)));
    const auto* begin = reinterpret_cast<const std::uint8_t*>(values);
    bytes_.insert(bytes_.end(), begin, begin + count * sizeof(T));
  }
  template <visit::Number T>
  void put(const T& value) {
    put_all(&value, 1);
  }
  template <visit::Enumerator T>
  void put(const T& value) {
    put(static_cast<std::uint8_t>(value));
  }
  template <visit::Struct T>
  void put(const T& value) {
    fields(*this, value);
  }
  template <visit::Array T>
  void put(const T& values) {
    put_all(values.data(), values.size());
  }
  template <class T>
  void put(const std::vector<T>& values) {
    put(static_cast<std::uint32_t>(values.size()));
    if constexpr (visit::Number<T>)
      put_all(values.data(), values.size());
    else
      for (const T& value : values) put(value);
  }
  template <class T>
  void put(const std::optional<T>& value) {
    put(value.has_value());
    put(value.value_or(T{}));
  }
  void put(const std::string& text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    put_all(text.c_str(), text.size() + 1);
  }
  void put(const Vec3& v) { put_all(v.data(), 3); }
  void put(const Eigen::Quaterniond& q) { put(std::array{q.w(), q.x(), q.y(), q.z()}); }

  std::vector<std::uint8_t> bytes_;
};

// Fails once and for all at the first value that isn't there; the values that it has given by then are of no use.
class CdrReader {
 public:
  explicit CdrReader(std::span<const std::uint8_t> bytes) : bytes_(bytes), at_(sizeof kEncapsulation) {
    ok_ = bytes.size() >= at_ && std::memcmp(bytes.data(), kEncapsulation, sizeof kEncapsulation) == 0;
  }

  template <class T, class... Limits>
  void operator()(const char*, T& value, Limits...) {
    get(value);
  }
  bool at_end() const { return ok_ && bytes_.size() - at_ <= kMostPadding; }

 private:
  bool has(std::size_t size) {
    ok_ = ok_ && bytes_.size() - at_ >= size;
    return ok_;
  }
  // Skips the padding before `count` values of `size` bytes. False when the message is too short for them.
  bool align(std::size_t count, std::size_t size) {
    if (count == 0) return ok_;
    const std::size_t skip = padding(at_, size);
    if (!has(skip) || (bytes_.size() - at_ - skip) / size < count) return ok_ = false;
    at_ += skip;
    return true;
  }
  template <visit::Number T>
  void get_all(T* values, std::size_t count) {
    if (count == 0 || !align(count, sizeof(T))) return;
    std::memcpy(values, bytes_.data() + at_, count * sizeof(T));
    at_ += count * sizeof(T);
  }
  template <visit::Number T>
  void get(T& value) {
    get_all(&value, 1);
  }
  void get(bool& value) {
    std::uint8_t byte = 0;
    get(byte);
    ok_ = ok_ && byte <= 1;
    value = byte == 1;
  }
  template <visit::Enumerator T>
  void get(T& value) {
    std::uint8_t byte = 0;
    get(byte);
    value = static_cast<T>(byte);
  }
  template <visit::Struct T>
  void get(T& value) {
    fields(*this, value);
  }
  template <visit::Array T>
  void get(T& values) {
    get_all(values.data(), values.size());
  }
  // Elements of no fixed size are added one by one, so that a count that lies allocates nothing.
  template <class T>
  void get(std::vector<T>& values) {
    std::uint32_t count = 0;
    get(count);
    values.clear();
    if constexpr (visit::Number<T>) {
      if (!align(count, sizeof(T))) return;
      values.resize(count);
      get_all(values.data(), count);
    } else {
      for (std::uint32_t i = 0; i < count && has(1); ++i) get(values.emplace_back());
    }
  }
  template <class T>
  void get(std::optional<T>& value) {
    bool there = false;
    get(there);
    T content{};
    get(content);
    value.reset();
    if (there) value = std::move(content);
  }
  void get(std::string& text) {
    std::uint32_t size = 0;
    get(size);
    if (size == 0 || !has(size) || bytes_[at_ + size - 1] != 0) {
      ok_ = false;
      return;
    }
    text.assign(reinterpret_cast<const char*>(bytes_.data() + at_), size - 1);
    at_ += size;
  }
  void get(Vec3& v) { get_all(v.data(), 3); }
  // Rounding must not grow from hop to hop: a quaternion of length 1 stays as it is, bit for bit.
  void get(Eigen::Quaterniond& q) {
    std::array<double, 4> wxyz{};
    get(wxyz);
    q = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    if (std::abs(q.norm() - 1) < kUnitTolerance && std::abs(q.squaredNorm() - 1) > 1e-12) q.normalize();
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_;
  bool ok_ = false;
};

}  // namespace

template <class Message>
std::vector<std::uint8_t> encode(const Message& message) {
  CdrWriter writer;
  fields(writer, message);
  return writer.take();
}

template <class Message>
std::optional<Message> decode(std::span<const std::uint8_t> bytes) {
  Message message;
  CdrReader reader(bytes);
  fields(reader, message);
  if (!reader.at_end() || !first_flaw(message).empty()) return std::nullopt;
  return message;
}

// NOLINTBEGIN(bugprone-macro-parentheses): M is a type.
#define SECTIO_CODEC(M)                                   \
  template std::vector<std::uint8_t> encode<M>(const M&); \
  template std::optional<M> decode<M>(std::span<const std::uint8_t>)
// NOLINTEND(bugprone-macro-parentheses)

SECTIO_CODEC(ToolPacket);
SECTIO_CODEC(ContactMessage);
SECTIO_CODEC(DeltaMessage);
SECTIO_CODEC(KeyframeChunk);
SECTIO_CODEC(KeyframeRequest);
SECTIO_CODEC(StateHeader);
SECTIO_CODEC(StatePiece);
SECTIO_CODEC(ScalarPiece);
SECTIO_CODEC(SceneInfo);
SECTIO_CODEC(SessionEvent);
SECTIO_CODEC(LinkReport);
SECTIO_CODEC(ServerStatus);
SECTIO_CODEC(SessionOrder);
SECTIO_CODEC(SessionEnd);
SECTIO_CODEC(ToolWish);
SECTIO_CODEC(StepInputs);
SECTIO_CODEC(StepRequest);
SECTIO_CODEC(Hello);
SECTIO_CODEC(ToolClaim);
SECTIO_CODEC(Roster);
SECTIO_CODEC(Notice);

}  // namespace sectio
