// A journal is a session's topology on disk: the keyframe of every body, then every delta in order. Replaying it gives
// the final meshes, hash for hash. The scalars that engines publish stand between the deltas, as the recorder saw them.
//
// File: "SECTIOJ1", bodies (u32), then for each body: name length (u32), name, keyframe length (u64), keyframe; then
// records until the end: body_id (u32), length (u32), checksum of the bytes (u64), delta. Little-endian. A record whose
// body_id is the number of bodies so far adds the next body instead: name length (u32), name, keyframe. A record of
// kGravityRecord changes gravity: step (u64), x, y, z (f64, m/s2). A kScalarsRecord holds a field: step (u64),
// body_id (u32), least, most (f32), name length (u32), name, number of vertex slots (u32), values (f32 each).
#pragma once

#include <cstdint>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/delta/keyframe.h"
#include "common/mesh/scalar_field.h"

namespace sectio {

struct JournalBody {
  std::string name;
  TriangleMesh mesh;
};

constexpr std::uint32_t kGravityRecord = 0xffffffffu, kScalarsRecord = 0xfffffffeu;

// Gravity from this step on.
struct JournalGravity {
  std::uint64_t step = 0;
  Vec3 gravity_m_per_s2 = Vec3::Zero();
};

// A field that an engine published of a body in this step, one value a vertex slot that the body had then.
struct JournalScalars {
  std::uint64_t step = 0;
  std::uint32_t body_id = 0;
  ScalarField field;
};

class JournalWriter {
 public:
  // Creates the file with the present state of every body. Throws InputError when it can't be written.
  JournalWriter(const std::string& path, std::span<const JournalBody> bodies);
  // Goes on with a file of whole records, which name so many bodies.
  JournalWriter(const std::string& path, std::uint64_t bytes, std::uint32_t bodies);

  // Throws InputError when the disk is full.
  void append(std::uint32_t body_id, const TopologyDelta& delta);
  // Adds a body that came off another; its id is the number of bodies so far.
  void append(const JournalBody& body);
  void append(const JournalGravity& gravity);
  void append(const JournalScalars& scalars);
  std::uint64_t bytes() const { return size_; }  // size of the file

 private:
  void write(std::span<const std::uint8_t> bytes);
  void append(std::uint32_t body_id, std::span<const std::uint8_t> bytes);

  std::string path_;
  std::ofstream file_;
  std::uint64_t size_ = 0;
  std::uint32_t bodies_ = 0;
};

struct JournalEntry {
  std::uint32_t body_id = 0;
  TopologyDelta delta;
};

// Reads one entry at a time; never holds more than one record beside the bodies. Truncated or damaged files throw
// InputError "FILE: byte N: what is wrong"; entries before the damage have been delivered by then.
class JournalReader {
 public:
  explicit JournalReader(const std::string& path);

  // The session's bodies in their initial state, and those added by the records read so far.
  const std::vector<JournalBody>& bodies() const { return bodies_; }
  // The changes of gravity read so far.
  const std::vector<JournalGravity>& gravity() const { return gravity_; }
  // The newest of each field of each body read so far, in the order in which they were first seen.
  const std::vector<JournalScalars>& scalars() const { return scalars_; }

  // The next delta; nothing at the end of the file.
  std::optional<JournalEntry> next();

 private:
  [[noreturn]] void fail(std::uint64_t byte, const std::string& what) const;
  std::vector<std::uint8_t> read(std::uint64_t size, const std::string& what);
  JournalBody read_body();
  void add_body(std::span<const std::uint8_t> bytes, std::uint64_t begin);
  void add_gravity(std::span<const std::uint8_t> bytes, std::uint64_t begin);
  void add_scalars(std::span<const std::uint8_t> bytes, std::uint64_t begin);

  std::string path_;
  std::ifstream file_;
  std::uint64_t size_ = 0;
  std::uint64_t at_ = 0;
  std::vector<JournalBody> bodies_;
  std::vector<JournalGravity> gravity_;
  std::vector<JournalScalars> scalars_;
};

// All that a journal holds before its first damage, if it has one.
struct JournalContents {
  std::vector<JournalBody> bodies;      // after all deltas
  std::vector<JournalGravity> gravity;  // all changes, in order
  std::vector<JournalScalars> scalars;  // the last of each field of each body
  std::string damage;                   // "FILE: byte N: what is wrong", or a delta that doesn't fit its body; or empty
};
// Throws InputError when not even the beginning is whole.
JournalContents salvage_journal(const std::string& path);

// The contents of a journal without damage; a damaged journal throws InputError.
std::vector<JournalBody> read_journal(const std::string& path);
std::vector<JournalGravity> read_gravity(const std::string& path);
std::vector<JournalScalars> read_scalars(const std::string& path);

}  // namespace sectio
