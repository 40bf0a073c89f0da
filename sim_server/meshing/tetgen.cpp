#include "sim_server/meshing/tetgen.h"

#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "common/core/child_process.h"
#include "common/core/error.h"
#include "common/core/formatted.h"
#include "sim_server/meshing/tet_file.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;

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
std::string run(const std::vector<std::string>& words, double limit_s) {
  try {
    ChildProcess tetgen(words);
    if (const auto ending = tetgen.wait_for(limit_s)) return ending->well ? "" : "it " + ending->text;
  } catch (const std::system_error& error) {
    return error.code().message();
  }
  return formatted("it took longer than %g s", limit_s);
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
  const std::string switches = formatted("-pYq1.2/15a%.9g", largest_m3);
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
