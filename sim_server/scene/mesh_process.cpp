#include "sim_server/scene/mesh_process.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/core/child_process.h"
#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/own_directory.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct Descriptor {
  int fd = -1;
  ~Descriptor() { close(); }
  void close() {
    if (fd >= 0) ::close(fd);
    fd = -1;
  }
};

// mesh_reader lies beside the program that runs, or, when that is installed, among what no person calls.
std::string reader_path() {
  const fs::path folder = own_directory();
  for (const fs::path& reader : {folder / "mesh_reader", folder.parent_path() / "libexec/sectio/mesh_reader"})
    if (!folder.empty() && ::access(reader.c_str(), X_OK) == 0) return reader.string();
  throw std::runtime_error("program mesh_reader not found beside " + folder.string());
}

class Reader {
 public:
  Reader(const std::string& path, const ImportLimits& limits, const MeshChoice& choice) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
    pipe_.fd = ends[0];
    const Descriptor write_end{ends[1]};
    const std::vector<std::string> words{reader_path(),
                                         path,
                                         std::to_string(limits.triangles),
                                         std::to_string(limits.memory_bytes),
                                         std::to_string(static_cast<long>(std::ceil(limits.time_s)) + 1),
                                         choice.any_format ? "any" : "known",
                                         choice.part};
    child_.emplace(words, ChildOptions{.descriptors = {{write_end.fd, kMeshPipe}}});
  }

  int pipe() const { return pipe_.fd; }
  // Call it at the end of the pipe.
  std::string ending() { return "its reader " + child_->wait().text; }

 private:
  Descriptor pipe_;
  std::optional<ChildProcess> child_;
};

class PipeReader {
 public:
  PipeReader(Reader& reader, const std::string& path, const ImportLimits& limits)
      : reader_(reader),
        path_(path),
        limits_(limits),
        deadline_(Clock::now() +
                  std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(limits.time_s))) {}

  [[noreturn]] void refuse(const std::string& why) const { throw InputError(path_ + ": " + why); }

  void read(void* target, std::size_t bytes) {
    auto* to = static_cast<char*>(target);
    while (bytes > 0) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline_ - Clock::now()).count();
      pollfd poll_fd{reader_.pipe(), POLLIN, 0};
      const int ready = left > 0 ? ::poll(&poll_fd, 1, static_cast<int>(std::min<long>(left, 60'000))) : 0;
      if (ready < 0 && errno == EINTR) continue;
      if (ready == 0 && Clock::now() < deadline_) continue;
      if (ready == 0) refuse(formatted("damaged file: not read within %g s", limits_.time_s));
      const ssize_t got = ::read(reader_.pipe(), to, bytes);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) refuse("damaged file, or one that needs more than the memory allowed: " + reader_.ending());
      to += got;
      bytes -= static_cast<std::size_t>(got);
    }
  }

 private:
  Reader& reader_;
  const std::string& path_;
  const ImportLimits& limits_;
  Clock::time_point deadline_;
};

void check_file(const std::string& path, const ImportLimits& limits) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) throw InputError(path + ": no such file");
  if (!fs::is_regular_file(status)) throw InputError(path + ": not a file");
  const std::uintmax_t size = fs::file_size(path, error);
  if (error || ::access(path.c_str(), R_OK) != 0) throw InputError(path + ": can't be read");
  if (size == 0) throw InputError(path + ": the file is empty");
  if (size > limits.file_bytes)
    throw InputError(path + ": larger than " + std::to_string(limits.file_bytes) + " bytes");
}

}  // namespace

TriangleSoup read_mesh_file(const std::string& path, const ImportLimits& limits, const MeshChoice& choice) {
  check_file(path, limits);
  Reader reader(path, limits, choice);
  PipeReader pipe(reader, path, limits);

  MeshPipeHeader header;
  pipe.read(&header, sizeof header);
  if (header.magic != MeshPipeHeader{}.magic) pipe.refuse("damaged file: its reader went astray");
  if (header.status != 0) {
    std::string why(static_cast<std::size_t>(std::min<std::uint64_t>(header.vertices, 1000)), ' ');
    pipe.read(why.data(), why.size());
    pipe.refuse(why);
  }
  if (header.triangles > limits.triangles || header.vertices > 3 * std::uint64_t{limits.triangles}) {
    pipe.refuse("more than " + std::to_string(limits.triangles) + " triangles");
  }
  TriangleSoup soup;
  soup.vertices_body_m.resize(static_cast<std::size_t>(header.vertices));
  soup.triangles.resize(static_cast<std::size_t>(header.triangles));
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  pipe.read(soup.vertices_body_m.data(), soup.vertices_body_m.size() * sizeof(Vec3));
  pipe.read(soup.triangles.data(), soup.triangles.size() * sizeof(soup.triangles[0]));

  for (std::size_t v = 0; v < soup.vertices_body_m.size(); ++v) {
    if (!soup.vertices_body_m[v].allFinite()) pipe.refuse("vertex " + std::to_string(v) + " is not finite");
  }
  for (const auto& triangle : soup.triangles) {
    for (const VertexId v : triangle) {
      if (v >= header.vertices) pipe.refuse("damaged file: its reader went astray");
    }
  }
  return soup;
}

}  // namespace sectio
