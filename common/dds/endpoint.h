// Writer<T> and Reader<T> of one topic, T a message of idl/. They live no longer than their participant.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/dds/participant.h"

namespace sectio {

// Any thread. write() is synchronous: when it returns, best-effort samples are in the socket.
template <class T>
class Writer {
 public:
  explicit Writer(Participant& participant);
  ~Writer();

  // False when the sample was refused: too large, or by Fast DDS.
  [[nodiscard]] bool write(const T& message);
  std::uint32_t readers() const;
  std::uint32_t lost_readers() const;  // programs that fell silent without a word and have not come back
  // Until every matched reader has everything that is still kept, or the time is over. True for the former.
  bool wait_for_acknowledgments(double timeout_s);

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

// One thread at a time.
template <class T>
class Reader {
 public:
  explicit Reader(Participant& participant);
  ~Reader();

  // The next sample, oldest first; false when there is none. Never blocks.
  bool take(T& message);
  std::uint32_t writers() const;

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

// The bytes of a sample as they travel. decode() is what a reader does: false for anything that can't be a T, whatever
// the bytes are; allocates at most a small multiple of their number.
template <class T>
std::vector<std::uint8_t> encode(const T& message);
template <class T>
bool decode(std::span<const std::uint8_t> bytes, T& message);

}  // namespace sectio
