#include "sim_server/net/session_record.h"

#include <idl_text.h>

namespace sectio {

SessionRecord::SessionRecord(const std::string& path, const InputLogHeader& header)
    : path_(path), writer_(path, kRecordChunkBytes) {
  writer_.add_metadata(kRecordMetadata, {{kRecordHeader, to_json(header)}});
}

void SessionRecord::add(const TopicQos& topic, const std::vector<std::uint8_t>& bytes) {
  auto channel = channels_.find(topic.name);
  if (channel == channels_.end())
    channel = channels_.emplace(topic.name, writer_.add_channel(topic.name, topic.type, kIdlText)).first;
  is_full_ = !writer_.add(channel->second, time_ns_, bytes) || is_full_;
}

std::optional<std::string> SessionRecord::take_fault() {
  if (!is_full_ || told_) return std::nullopt;
  told_ = true;
  return path_ + ": the record ends here: is the disk full?";
}

}  // namespace sectio
