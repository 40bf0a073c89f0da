#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "common/core/child_process.h"
#include "common/core/error.h"
#include "sim_server/commands/commands.h"
#include "sim_server/scene/mesh_import.h"
#include "sim_server/scene/tissues.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;

constexpr double kHeldShare = 0.15;  // of the height, from below
constexpr double kPictureLimit_s = 60;

struct OrganFlags {
  std::string in, out, unit = "m", part, tissue;
  double size_mm = 0;
};

void write_text(const fs::path& path, const std::string& text) {
  if (!(std::ofstream(path) << text)) throw InputError(path.string() + ": can't be written");
}

// With its middle at the origin.
Vec3 centre(TriangleSoup& soup) {
  Vec3 low = soup.vertices_body_m[0], high = low;
  for (const Vec3& p : soup.vertices_body_m) low = low.cwiseMin(p), high = high.cwiseMax(p);
  for (Vec3& p : soup.vertices_body_m) p -= 0.5 * (low + high);
  return high - low;
}

std::string as_obj(const TriangleSoup& soup) {
  std::string text = "# metres\n";
  char line[96];
  for (const Vec3& p : soup.vertices_body_m) {
    std::snprintf(line, sizeof line, "v %.7g %.7g %.7g\n", p.x(), p.y(), p.z());
    text += line;
  }
  for (const auto& t : soup.triangles) {
    std::snprintf(line, sizeof line, "f %u %u %u\n", t[0] + 1, t[1] + 1, t[2] + 1);
    text += line;
  }
  return text;
}

std::string as_scene(const Vec3& sizes_m, const std::string& tissue) {
  const double far_m = 2.4 * sizes_m.norm();
  char text[900];
  std::snprintf(text, sizeof text,
                "# An organ that lies where it was made, held from below.\n"
                "session: organ\nstep_s: auto\nduration_s: 2\nexpect: {incisions: 0}\n\n"
                "camera:\n  eye_world_m: [%.4g, %.4g, %.4g]\n  target_world_m: [0, 0, 0]\n  field_of_view_deg: 28\n\n"
                "bodies:\n  - name: organ\n    mesh: {file: organ.obj, unit: m}\n    model: surface_springs\n%s"
                "    fixed: {min_world_m: [-5, -5, -5], max_world_m: [5, 5, %.5g]}\n",
                -0.3 * far_m, -0.75 * far_m, 0.6 * far_m,
                tissue.empty() ? "" : ("    tissue: " + tissue + "\n").c_str(), (kHeldShare - 0.5) * sizes_m.z());
  return text;
}

// By the program for pictures, where it lies beside this one.
void draw(const fs::path& folder) {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "draw_scenes";
  if (!fs::exists(program)) {
    std::printf("picture: none, since %s is missing\n", program.c_str());
    return;
  }
  ChildProcess child(
      {program.string(), (folder / "organ.png").string(), "--scene", (folder / "scene.yaml").string() + "@0"});
  const auto ending = child.wait_for(kPictureLimit_s);
  const bool drawn = ending && ending->well;
  std::printf("picture: %s\n", drawn ? (folder / "organ.png").c_str() : "none, since drawing it failed");
}

int make_organ(const OrganFlags& flags) {
  const std::vector<std::string> known = tissue_names();
  if (!flags.tissue.empty() && std::ranges::find(known, flags.tissue) == known.end()) {
    std::string names;
    for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
    throw InputError("--tissue: expected one of " + names + ", got " + flags.tissue);
  }
  if (!(flags.size_mm >= 0)) throw InputError("--size-mm: expected > 0");
  const double unit_m = flags.unit == "m" ? 1 : flags.unit == "cm" ? 0.01 : 0.001;
  ImportedMesh organ = import_wrapped(flags.in, unit_m, {flags.part, 0.001 * flags.size_mm});
  for (const std::string& note : organ.mended) std::printf("%s\n", note.c_str());
  const Vec3 sizes_m = centre(organ.soup);
  std::error_code error;
  fs::create_directories(flags.out, error);
  if (error) throw InputError(flags.out + ": can't be made: " + error.message());
  const fs::path folder(flags.out);
  write_text(folder / "organ.obj", as_obj(organ.soup));
  write_text(folder / "scene.yaml", as_scene(sizes_m, flags.tissue));
  std::printf("mesh: %s\nscene: %s\n", (folder / "organ.obj").c_str(), (folder / "scene.yaml").c_str());
  draw(folder);
  return 0;
}

}  // namespace

// A file of anatomy, as it comes, to a body: mesh, a scene that runs, and a picture.
Arguments::Action organ_command(Arguments& arguments) {
  const auto flags = std::make_shared<OrganFlags>();
  arguments.option("IN", flags->in, "triangles in any format that assimp reads", Need::required);
  arguments.option("--out", flags->out, "directory for organ.obj, scene.yaml and organ.png", Need::required);
  arguments.option("--part", flags->part, "only parts in whose name this is found; empty: all");
  arguments.option("--size-mm", flags->size_mm, "about the length of an edge; 0: for about 8000 triangles");
  arguments.choice("--unit", flags->unit, {"m", "cm", "mm"}, "length of IN's unit");
  arguments.option("--tissue", flags->tissue, "tissue of the scene's body");
  return [flags] { return make_organ(*flags); };
}

}  // namespace sectio
