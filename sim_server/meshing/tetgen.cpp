#include "sim_server/meshing/tetgen.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <thread>

#include "common/core/error.h"
#include "sim_server/meshing/tet_file.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

std::string program() {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string candidate = folder + "/tetgen";
    if (!folder.empty() && ::access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return {};
}

class WorkFolder {
 public:
  WorkFolder() : path_((fs::temp_directory_path() / "sectio_tetgen_XXXXXX").string()) {
    if (!::mkdtemp(path_.data())) throw std::runtime_error(path_ + ": " + std::strerror(errno));
  }
  ~WorkFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  std::string operator/(const char* name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

void write_poly(const std::string& path, const TriangleSoup& surface) {
  std::FILE* const f = std::fopen(path.c_str(), "w");
  if (!f) throw std::runtime_error(path + ": " + std::strerror(errno));
  std::fprintf(f, "%zu 3 0 0\n", surface.vertices_body_m.size());
  for (std::size_t v = 0; v < surface.vertices_body_m.size(); ++v) {
    const Vec3& x = surface.vertices_body_m[v];
    std::fprintf(f, "%zu %.17g %.17g %.17g\n", v, x.x(), x.y(), x.z());
  }
  std::fprintf(f, "%zu 0\n", surface.triangles.size());
  for (const auto& [a, b, c] : surface.triangles) std::fprintf(f, "1 0\n3 %u %u %u\n", a, b, c);
  std::fputs("0\n0\n", f);
  std::fclose(f);
}

// Runs the program. Returns an empty text if it succeeded, else a reason for a person.
std::string run(std::vector<std::string> words, double limit_s) {
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int standard : {0, 1, 2})
    posix_spawn_file_actions_addopen(&actions, standard, "/dev/null", standard == 0 ? O_RDONLY : O_WRONLY, 0);
  pid_t child = -1;
  const int error = ::posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) return std::strerror(error);
  const auto deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(limit_s));
  int status = 0;
  for (;;) {
    const pid_t done = ::waitpid(child, &status, WNOHANG);
    if (done == child) break;
    if (done < 0 && errno != EINTR) return "it is gone";
    if (Clock::now() >= deadline) {
      ::kill(child, SIGKILL);
      ::waitpid(child, &status, 0);
      char text[60];
      std::snprintf(text, sizeof text, "it took longer than %g s", limit_s);
      return text;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  if (WIFSIGNALED(status)) return std::string("it crashed (") + ::strsignal(WTERMSIG(status)) + ")";
  return WEXITSTATUS(status) == 0 ? "" : "it ended with code " + std::to_string(WEXITSTATUS(status));
}

}  // namespace

bool tetgen_installed() {
  return !program().empty();
}

TetMesh fill_with_tetgen(const TriangleSoup& surface, double largest_m3, double limit_s) {
  const std::string tetgen = program();
  if (tetgen.empty()) throw InputError("the program tetgen is not installed");
  const WorkFolder folder;
  write_poly(folder / "organ.poly", surface);
  // p: a surface; Y: keep its triangles; q: radius over edge 1.2, dihedral angles 15 degrees; a: largest volume.
  // These switches gave the largest stable step of those that were tried on organs.
  char switches[80];
  std::snprintf(switches, sizeof switches, "-pYq1.2/15a%.9g", largest_m3);
  if (const std::string flaw = run({tetgen, switches, folder / "organ.poly"}, limit_s); !flaw.empty())
    throw InputError("tetgen failed: " + flaw);
  if (!fs::exists(folder / "organ.1.ele")) throw InputError("tetgen failed: it wrote no tetrahedra");
  try {
    return read_tet_file(folder / "organ.1.ele", 1).mesh;
  } catch (const InputError& error) {
    throw InputError(std::string("tetgen's result can't serve: ") + error.what());
  }
}

}  // namespace sectio
