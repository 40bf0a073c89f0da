#include "common/delta/journal.h"

#include <algorithm>
#include <string_view>

#include "common/core/error.h"
#include "common/core/write_file.h"
#include "common/delta/bytes.h"
#include "common/delta/checksum.h"

namespace sectio {

namespace {

constexpr std::string_view kMagic = "SECTIOJ1";
constexpr std::uint32_t kMaxBodiesInFile = 4096;
constexpr std::uint32_t kMaxNameInFile_bytes = 4096;

std::span<const std::uint8_t> as_bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

JournalWriter::JournalWriter(const std::string& path, std::span<const JournalBody> bodies)
    : path_(path), file_(path, std::ios::binary | std::ios::trunc) {
  if (!file_) throw InputError(path + ": can't be written");
  bodies_ = static_cast<std::uint32_t>(bodies.size());
  ByteWriter out;
  out.put_bytes(as_bytes(kMagic));
  out.put(static_cast<std::uint32_t>(bodies.size()));
  for (const JournalBody& body : bodies) {
    out.put(static_cast<std::uint32_t>(body.name.size()));
    out.put_bytes(as_bytes(body.name));
    const std::vector<std::uint8_t> keyframe = to_bytes(keyframe_of(body.mesh));
    out.put(static_cast<std::uint64_t>(keyframe.size()));
    out.put_bytes(keyframe);
  }
  write(out.bytes());
}

JournalWriter::JournalWriter(const std::string& path, std::uint64_t bytes, std::uint32_t bodies)
    : path_(path), file_(path, std::ios::binary | std::ios::app), size_(bytes), bodies_(bodies) {
  if (!file_) throw InputError(path + ": can't be written");
}

void JournalWriter::append(std::uint32_t body_id, const TopologyDelta& delta) {
  append(body_id, to_bytes(delta));
}

void JournalWriter::append(const JournalBody& body) {
  ByteWriter content;
  content.put(static_cast<std::uint32_t>(body.name.size()));
  content.put_bytes(as_bytes(body.name));
  content.put_bytes(to_bytes(keyframe_of(body.mesh)));
  append(bodies_++, content.bytes());
}

void JournalWriter::append(const JournalGravity& gravity) {
  ByteWriter content;
  content.put(gravity.step);
  for (int i = 0; i < 3; ++i) content.put(gravity.gravity_m_per_s2[i]);
  append(kGravityRecord, content.bytes());
}

void JournalWriter::append(const JournalScalars& scalars) {
  ByteWriter content;
  content.put(scalars.step);
  content.put(scalars.body_id);
  content.put(scalars.field.least);
  content.put(scalars.field.most);
  content.put(static_cast<std::uint32_t>(scalars.field.name.size()));
  content.put_bytes(as_bytes(scalars.field.name));
  content.put(static_cast<std::uint32_t>(scalars.field.values.size()));
  for (const float value : scalars.field.values) content.put(value);
  append(kScalarsRecord, content.bytes());
}

void JournalWriter::append(std::uint32_t body_id, std::span<const std::uint8_t> bytes) {
  ByteWriter out;
  out.put(body_id);
  out.put(static_cast<std::uint32_t>(bytes.size()));
  out.put(checksum(body_id, bytes));
  out.put_bytes(bytes);
  write(out.bytes());
}

// Flushes each record, so that it survives a crash of the program.
void JournalWriter::write(std::span<const std::uint8_t> bytes) {
  file_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file_.flush();
  if (!file_) {
    keep_beginning(path_, size_);
    throw InputError(path_ + ": can't be written: is the disk full?");
  }
  size_ += bytes.size();
}

JournalReader::JournalReader(const std::string& path) : path_(path), file_(path, std::ios::binary | std::ios::ate) {
  if (!file_ || file_.tellg() < 0) throw InputError(path + ": can't be read");
  size_ = static_cast<std::uint64_t>(file_.tellg());
  file_.seekg(0);
  if (size_ < kMagic.size() || !std::ranges::equal(read(kMagic.size(), "header"), as_bytes(kMagic)))
    fail(0, "not a journal");
  const std::vector<std::uint8_t> count_bytes = read(4, "number of bodies");
  const auto count = ByteReader(count_bytes).get<std::uint32_t>();
  if (count > kMaxBodiesInFile) fail(at_ - 4, "too many bodies: " + std::to_string(count));
  for (std::uint32_t i = 0; i < count; ++i) bodies_.push_back(read_body());
}

JournalBody JournalReader::read_body() {
  const std::vector<std::uint8_t> name_size_bytes = read(4, "length of a name");
  const auto name_size = ByteReader(name_size_bytes).get<std::uint32_t>();
  if (name_size > kMaxNameInFile_bytes) fail(at_ - 4, "a name can't be so long");
  const std::vector<std::uint8_t> name = read(name_size, "name");
  const std::vector<std::uint8_t> size_bytes = read(8, "length of a keyframe");
  const auto size = ByteReader(size_bytes).get<std::uint64_t>();
  const std::uint64_t begin = at_;
  std::optional<Keyframe> keyframe = keyframe_from_bytes(read(size, "keyframe"));
  std::optional<TriangleMesh> mesh;
  if (keyframe) mesh = mesh_of(std::move(*keyframe));
  if (!mesh) fail(begin, "damaged keyframe");
  return {std::string(name.begin(), name.end()), std::move(*mesh)};
}

std::optional<JournalEntry> JournalReader::next() {
  while (at_ != size_) {
    const std::uint64_t begin = at_;
    const std::vector<std::uint8_t> header = read(16, "record");
    ByteReader in(header);
    const auto body_id = in.get<std::uint32_t>();
    const auto length = in.get<std::uint32_t>();
    const auto sum = in.get<std::uint64_t>();
    const std::vector<std::uint8_t> bytes = read(length, "record");
    if (checksum(body_id, bytes) != sum) fail(begin, "damaged record");
    if (body_id == bodies_.size()) {
      add_body(bytes, begin);
      continue;
    }
    if (body_id == kGravityRecord) {
      add_gravity(bytes, begin);
      continue;
    }
    if (body_id == kScalarsRecord) {
      add_scalars(bytes, begin);
      continue;
    }
    std::optional<TopologyDelta> delta = delta_from_bytes(bytes);
    if (!delta || body_id > bodies_.size()) fail(begin, "record that no journal holds");
    return JournalEntry{body_id, std::move(*delta)};
  }
  return std::nullopt;
}

void JournalReader::add_gravity(std::span<const std::uint8_t> bytes, std::uint64_t begin) {
  if (bytes.size() != 32) fail(begin, "record that no journal holds");
  ByteReader in(bytes);
  JournalGravity& gravity = gravity_.emplace_back();
  gravity.step = in.get<std::uint64_t>();
  for (int i = 0; i < 3; ++i) gravity.gravity_m_per_s2[i] = in.get<double>();
  if (!gravity.gravity_m_per_s2.allFinite()) fail(begin, "record that no journal holds");
}

void JournalReader::add_scalars(std::span<const std::uint8_t> bytes, std::uint64_t begin) {
  ByteReader in(bytes);
  JournalScalars scalars;
  scalars.step = in.get<std::uint64_t>();
  scalars.body_id = in.get<std::uint32_t>();
  scalars.field.least = in.get<float>();
  scalars.field.most = in.get<float>();
  const auto name_size = in.get<std::uint32_t>();
  if (!in.ok() || name_size > in.remaining()) fail(begin, "record that no journal holds");
  for (std::uint32_t i = 0; i < name_size; ++i) scalars.field.name.push_back(static_cast<char>(in.get<std::uint8_t>()));
  const auto count = in.get<std::uint32_t>();
  if (scalars.body_id >= bodies_.size() || in.remaining() != sizeof(float) * std::size_t{count})
    fail(begin, "record that no journal holds");
  for (std::uint32_t v = 0; v < count; ++v) scalars.field.values.push_back(in.get<float>());
  const auto same = [&](const JournalScalars& s) {
    return s.body_id == scalars.body_id && s.field.name == scalars.field.name;
  };
  const auto known = std::ranges::find_if(scalars_, same);
  known != scalars_.end() ? void(*known = std::move(scalars)) : scalars_.push_back(std::move(scalars));
}

void JournalReader::add_body(std::span<const std::uint8_t> bytes, std::uint64_t begin) {
  const std::size_t name_size = bytes.size() < 4 ? bytes.size() : ByteReader(bytes).get<std::uint32_t>();
  if (bodies_.size() >= kMaxBodiesInFile || name_size > kMaxNameInFile_bytes || 4 + name_size > bytes.size())
    fail(begin, "record that no journal holds");
  std::optional<Keyframe> keyframe = keyframe_from_bytes(bytes.subspan(4 + name_size));
  std::optional<TriangleMesh> mesh;
  if (keyframe) mesh = mesh_of(std::move(*keyframe));
  if (!mesh) fail(begin, "damaged keyframe");
  bodies_.push_back(
      {std::string(bytes.begin() + 4, bytes.begin() + 4 + static_cast<std::ptrdiff_t>(name_size)), std::move(*mesh)});
}

std::vector<std::uint8_t> JournalReader::read(std::uint64_t size, const std::string& what) {
  if (size > size_ - at_) fail(at_, "truncated " + what);
  std::vector<std::uint8_t> bytes(size);
  if (!file_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    fail(at_, "can't be read");
  at_ += size;
  return bytes;
}

void JournalReader::fail(std::uint64_t byte, const std::string& what) const {
  throw InputError(path_ + ": byte " + std::to_string(byte) + ": " + what);
}

JournalContents salvage_journal(const std::string& path) {
  JournalReader reader(path);
  JournalContents contents;
  std::vector<JournalBody>& bodies = contents.bodies;
  bodies = reader.bodies();
  std::uint64_t number = 0;
  try {
    while (const std::optional<JournalEntry> entry = reader.next()) {
      ++number;
      while (bodies.size() < reader.bodies().size()) bodies.push_back(reader.bodies()[bodies.size()]);
      const ApplyStatus status = apply(entry->delta, bodies[entry->body_id].mesh);
      if (status != ApplyStatus::applied)
        throw InputError(path + ": delta " + std::to_string(number) + ": " + to_string(status));
    }
  } catch (const InputError& error) {
    contents.damage = error.what();
  }
  while (bodies.size() < reader.bodies().size()) bodies.push_back(reader.bodies()[bodies.size()]);
  contents.gravity = reader.gravity();
  contents.scalars = reader.scalars();
  return contents;
}

namespace {

JournalContents read_undamaged(const std::string& path) {
  JournalContents contents = salvage_journal(path);
  if (!contents.damage.empty()) throw InputError(contents.damage);
  return contents;
}

}  // namespace

std::vector<JournalBody> read_journal(const std::string& path) {
  return read_undamaged(path).bodies;
}

std::vector<JournalScalars> read_scalars(const std::string& path) {
  return read_undamaged(path).scalars;
}

std::vector<JournalGravity> read_gravity(const std::string& path) {
  return read_undamaged(path).gravity;
}

}  // namespace sectio
