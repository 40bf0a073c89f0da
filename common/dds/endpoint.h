// Writer<M> and Reader<M> of the topic of a message. They live no longer than their participant.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/core/log.h"
#include "common/dds/participant.h"
#include "common/dds/qos.h"
#include "common/messages/codec.h"

namespace sectio {

using Bytes = std::vector<std::uint8_t>;

// Writes samples of one topic as bytes. Any thread.
class SampleWriter {
 public:
  SampleWriter(Participant& participant, const TopicQos& topic);
  ~SampleWriter();
  SampleWriter(SampleWriter&&) noexcept;

  // Synchronous: when it returns, best-effort samples are in the socket. False when the sample was refused: too large,
  // or by Fast DDS.
  [[nodiscard]] bool write(const Bytes& bytes, std::size_t channel = 0);
  std::uint32_t readers(std::size_t channel = 0) const;
  std::uint32_t lost_readers() const;  // programs that fell silent without a word and have not come back
  // Waits until every matched reader has all samples that are still kept, or the time is over; true in the first case.
  bool wait_for_acknowledgments(double timeout_s);

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

// Reads samples of one topic as bytes. One thread at a time.
class SampleReader {
 public:
  SampleReader(Participant& participant, const TopicQos& topic);
  ~SampleReader();
  SampleReader(SampleReader&&) noexcept;

  // The next sample, oldest first; false when there is none. Never blocks.
  bool take(Bytes& bytes);
  const ProgramId& sender() const { return sender_; }  // sender of the last sample
  std::uint32_t writers() const;

 private:
  struct Core;
  std::unique_ptr<Core> core_;
  ProgramId sender_{};
};

template <class Message>
class Writer : public SampleWriter {
 public:
  explicit Writer(Participant& participant) : SampleWriter(participant, qos_of<Message>()) {}

  [[nodiscard]] bool write(const Message& message, std::size_t channel = 0) {
    return SampleWriter::write(encode(message), channel);
  }
};

template <class Message>
class Reader : public SampleReader {
 public:
  explicit Reader(Participant& participant) : SampleReader(participant, qos_of<Message>()) {}

  // The next valid message, oldest first; damaged ones are dropped and counted.
  std::optional<Message> take() {
    while (SampleReader::take(bytes_)) {
      if (auto message = decode<Message>(bytes_)) return message;
      ++damaged_;
      log_limited(LogLevel::warning, qos_of<Message>().name,
                  std::string("a damaged message was dropped: ") + qos_of<Message>().name);
    }
    return std::nullopt;
  }
  std::uint64_t damaged() const { return damaged_; }

 private:
  Bytes bytes_;
  std::uint64_t damaged_ = 0;
};

}  // namespace sectio
