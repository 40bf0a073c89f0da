// Files that a run leaves in its directory.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "common/math/positions_view.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

// Two runs must not write into one directory. The lock goes with its holder, however that ends.
class DirectoryLock {
 public:
  // Makes the directory; empty: nothing is locked. Throws InputError when another program holds it.
  explicit DirectoryLock(const std::string& path);
  ~DirectoryLock();
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;

 private:
  int file_ = -1;
};

// A directory with a session that has not ended, and the last step of its newest try.
struct Furthest {
  std::string directory;
  std::uint64_t step = 0;
};
// The first directory that holds a step of such a session; or one after it that has all of its steps and more of them,
// when the first one's server died as a standby, before it had caught up. Reads all steps.
std::optional<Furthest> furthest_unfinished(std::span<const std::string> newest_first);
// A session that has not ended may go on: its inputs must not be lost. Throws InputError when a directory, if there is
// one, holds such ones, or is held by another program.
void refuse_unfinished(const std::string& directory);
// Likewise, for a record: one that nobody has finished, with inputs.
void refuse_unfinished_record(const std::string& path);
// The file of a record. A server that goes on with a session leaves what has been recorded of it, and takes
// NAME_2.mcap, NAME_3.mcap, ...; so does one that begins a session where that has happened. Throws as
// refuse_unfinished_record().
std::string record_to_write(const std::string& path, bool goes_on);

// The tries of a session, each begun anew: the first one's files are in the directory itself, those of the others in
// try_2, try_3, ... in it. Empty: the session leaves nothing behind.
std::string try_directory(const std::string& directory, int attempt);
// The try whose inputs were written last, which is the one that a crash has ended.
int newest_try(const std::string& directory);
// The first one after `attempt` that has no files of an earlier session.
int free_try_after(const std::string& directory, int attempt);

// All throw InputError "PATH: why" when it can't be done.
void make_directory(const std::string& path);
// Copies the first bytes of a file to another; if both are the same file, shortens it. False when it has fewer bytes.
bool copy_beginning(const std::string& from, const std::string& to, std::uint64_t bytes);
// Copies a file from a byte on to PATH.damaged, or PATH.damaged.2 when that is there, and so on. Returns the copy's
// name after it is synced.
std::string keep_rest(const std::string& path, std::uint64_t from_byte);
// Wavefront OBJ of the live surface, skin and wall as groups, in metres.
void write_obj(const std::string& path, const TriangleMesh& mesh, PositionsView positions_world_m);

// DIRECTORY/BODY.obj
std::string obj_path(const std::string& directory, const std::string& body);

}  // namespace sectio
