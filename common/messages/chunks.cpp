#include "common/messages/chunks.h"

#include <algorithm>

#include "common/core/error.h"

namespace sectio {

std::vector<KeyframeChunk> split_keyframe(std::uint64_t epoch, std::uint32_t body_id, std::uint64_t revision,
                                          std::span<const std::uint8_t> bytes, std::uint32_t chunk_bytes) {
  SECTIO_ASSERT(!bytes.empty() && chunk_bytes > 0, "nothing to split");
  const auto count = static_cast<std::uint32_t>((bytes.size() + chunk_bytes - 1) / chunk_bytes);
  std::vector<KeyframeChunk> chunks(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::size_t begin = std::size_t{i} * chunk_bytes;
    const std::span part = bytes.subspan(begin, std::min<std::size_t>(chunk_bytes, bytes.size() - begin));
    chunks[i] = {epoch, body_id, revision, bytes.size(), i, count, {part.begin(), part.end()}};
  }
  return chunks;
}

std::uint32_t KeyframeAssembler::first_missing(std::uint32_t body_id) const {
  std::uint32_t first = 0;
  for (const auto& [chunk, bytes] : parts_.at(body_id).chunks) {
    if (chunk != first) break;
    ++first;
  }
  return first;
}

void KeyframeAssembler::forget(std::uint32_t body_id) {
  const auto found = parts_.find(body_id);
  if (found == parts_.end()) return;
  bytes_ -= found->second.bytes;
  parts_.erase(found);
}

std::optional<std::vector<std::uint8_t>> KeyframeAssembler::add(KeyframeChunk chunk) {
  const auto found = parts_.find(chunk.body_id);
  if (found == parts_.end() || found->second.revision != chunk.revision) {
    forget(chunk.body_id);
    parts_[chunk.body_id] = {chunk.revision, chunk.total_bytes, chunk.chunks, 0, {}};
  }
  Parts& parts = parts_[chunk.body_id];
  const bool fits = parts.total_bytes == chunk.total_bytes && parts.count == chunk.chunks && chunk.chunk < chunk.chunks;
  if (!fits || parts.chunks.contains(chunk.chunk)) return std::nullopt;
  const std::size_t size = chunk.bytes.size() + kPlaceBytes;
  parts.bytes += size;
  bytes_ += size;
  parts.chunks[chunk.chunk] = std::move(chunk.bytes);
  if (parts.chunks.size() < parts.count) return std::nullopt;

  std::vector<std::uint8_t> bytes;
  for (const auto& [place, part] : parts.chunks) bytes.insert(bytes.end(), part.begin(), part.end());
  const bool whole = bytes.size() == parts.total_bytes;
  forget(chunk.body_id);
  if (!whole) return std::nullopt;
  return bytes;
}

}  // namespace sectio
