#include "common/record/session_record.h"

#include <idl_text.h>

#include "common/delta/keyframe.h"
#include "common/messages/chunks.h"

namespace sectio {

SessionRecord::SessionRecord(const std::string& path, const std::map<std::string, std::string>& metadata)
    : path_(path), writer_(path, kRecordChunkBytes) {
  writer_.add_metadata(kRecordMetadata, metadata);
}

void SessionRecord::add(const TopicQos& topic, std::span<const std::uint8_t> bytes) {
  auto channel = channels_.find(topic.name);
  if (channel == channels_.end())
    channel = channels_.emplace(topic.name, writer_.add_channel(topic.name, topic.type, kIdlText)).first;
  if (!writer_.add(channel->second, time_ns_, bytes)) is_full_ = true;
}

void SessionRecord::add_keyframe(std::uint64_t epoch, std::uint32_t body_id, const TriangleMesh& mesh) {
  for (const KeyframeChunk& chunk :
       split_keyframe(epoch, body_id, mesh.revision(), to_bytes(keyframe_of(mesh)), kChunkBytes))
    add(chunk);
}

std::optional<std::string> SessionRecord::take_fault() {
  if (!is_full_ || told_) return std::nullopt;
  told_ = true;
  return fault();
}

std::optional<std::string> SessionRecord::finish() {
  return writer_.finish() ? std::nullopt : std::optional(fault());
}

}  // namespace sectio
