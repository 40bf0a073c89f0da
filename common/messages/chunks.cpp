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

std::optional<std::vector<std::uint8_t>> KeyframeAssembler::add(KeyframeChunk chunk) {
  const auto found = parts_.find(chunk.body_id);
  if (found == parts_.end() || found->second.revision != chunk.revision) {
    Parts fresh{chunk.revision, chunk.total_bytes, chunk.chunks, {}};
    fresh.chunks.resize(chunk.chunks);
    parts_[chunk.body_id] = std::move(fresh);
  }
  Parts& parts = parts_[chunk.body_id];
  const bool fits = parts.revision == chunk.revision && parts.total_bytes == chunk.total_bytes &&
                    parts.chunks.size() == chunk.chunks && chunk.chunk < chunk.chunks;
  if (!fits || !parts.chunks[chunk.chunk].empty()) return std::nullopt;
  parts.chunks[chunk.chunk] = std::move(chunk.bytes);
  if (--parts.missing > 0) return std::nullopt;

  std::vector<std::uint8_t> bytes;
  for (const auto& part : parts.chunks) bytes.insert(bytes.end(), part.begin(), part.end());
  const bool whole = bytes.size() == parts.total_bytes;
  parts_.erase(chunk.body_id);
  if (!whole) return std::nullopt;
  return bytes;
}

}  // namespace sectio
