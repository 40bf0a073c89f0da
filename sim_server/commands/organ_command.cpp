#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "common/core/child_process.h"
#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/joined.h"
#include "common/core/own_directory.h"
#include "common/core/write_file.h"
#include "common/material/regions.h"
#include "common/math/intersect.h"
#include "common/mesh/obj_text.h"
#include "sim_server/commands/commands.h"
#include "sim_server/scene/mesh_import.h"
#include "sim_server/scene/mesh_mend.h"
#include "sim_server/scene/mesh_process.h"
#include "sim_server/scene/tissues.h"
#include "sim_server/session/run_files.h"
#include "sim_server/wrap/fit_ellipsoids.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;

constexpr double kHeldShare = 0.15;  // share of the height, from below
constexpr double kPictureLimit_s = 60;
constexpr std::size_t kMostShapes = 12;  // shapes of a region
constexpr std::array kColours{"[0.86, 0.78, 0.62]", "[0.35, 0.42, 0.68]", "[0.72, 0.16, 0.14]", "[0.55, 0.62, 0.35]"};

struct OrganFlags {
  std::string in, out, unit = "m", part, tissue;
  std::vector<std::string> inside;
  double size_mm = 0;
};

Box3 box_of(const TriangleSoup& soup) {
  Box3 box;
  for (const Vec3& p : soup.vertices_body_m) box.extend(p);
  return box;
}

// Letters, digits and lines below for whatever a part is called.
std::string region_name(const std::string& part) {
  std::string name = part.find_first_not_of("0123456789") == std::string::npos ? "label_" + part : part;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name.substr(0, 64);
}

std::string as_region(const std::string& part, std::size_t number, const EllipsoidFit& fit) {
  std::string text = "      - name: " + region_name(part) + "\n        colour: " + kColours[number % kColours.size()] +
                     "\n        shapes:\n";
  for (const Ellipsoid& e : fit.ellipsoids) {
    const Mat3 m = e.orientation.toRotationMatrix();  // about x, then y, then z
    const double x = std::atan2(m(2, 1), m(2, 2)), z = std::atan2(m(1, 0), m(0, 0));
    const double y = std::atan2(-m(2, 0), std::hypot(m(0, 0), m(1, 0)));
    text += formatted(
        "          - ellipsoid: {centre_body_m: [%.5g, %.5g, %.5g], radii_m: [%.4g, %.4g, %.4g], rotation_deg: "
        "[%.2f, %.2f, %.2f]}\n",
        e.centre_m.x(), e.centre_m.y(), e.centre_m.z(), e.radii_m.x(), e.radii_m.y(), e.radii_m.z(), x * 180 / M_PI,
        y * 180 / M_PI, z * 180 / M_PI);
  }
  return text;
}

// The parts of the file that are regions inside the body, about the same middle as the body.
std::string as_regions(const OrganFlags& flags, double unit_m, const Vec3& middle_m) {
  std::string text;
  for (std::size_t i = 0; i < flags.inside.size(); ++i) {
    const std::string& part = flags.inside[i];
    TriangleSoup soup = read_mesh_file(flags.in, {}, {.part = part, .any_format = true});
    for (Vec3& p : soup.vertices_body_m) p = unit_m * p - middle_m;
    mend(soup);  // formats that give each triangle corners of its own
    try {
      const EllipsoidFit fit = fit_ellipsoids(soup, std::min(kMostShapes, kMaxRegionParts / flags.inside.size()));
      std::printf("region %s: %.4g ml, overlap of %.0f %% with %zu ellipsoid%s\n", region_name(part).c_str(),
                  1e6 * fit.volume_m3, 100 * fit.overlap, fit.ellipsoids.size(), fit.ellipsoids.size() == 1 ? "" : "s");
      text += as_region(part, i, fit);
    } catch (const InputError& error) {
      throw InputError(flags.in + ": " + part + ": " + error.what());
    }
  }
  return text.empty() ? text : "    regions:\n" + text;
}

std::string as_scene(const Vec3& sizes_m, const std::string& tissue, const std::string& regions) {
  const double far_m = 2.4 * sizes_m.norm();
  return formatted(
             "# An organ that lies where it was made, held from below.\n"
             "session: organ\nstep_s: auto\nduration_s: 2\nexpect: {incisions: 0}\n\n"
             "camera:\n  eye_world_m: [%.4g, %.4g, %.4g]\n  target_world_m: [0, 0, 0]\n  field_of_view_deg: 28\n\n"
             "bodies:\n  - name: organ\n    mesh: {file: organ.obj, unit: m}\n    model: surface_springs\n%s"
             "    fixed: {min_world_m: [-5, -5, -5], max_world_m: [5, 5, %.5g]}\n",
             -0.3 * far_m, -0.75 * far_m, 0.6 * far_m, tissue.empty() ? "" : ("    tissue: " + tissue + "\n").c_str(),
             (kHeldShare - 0.5) * sizes_m.z()) +
         regions;
}

// By the program for pictures, where it lies beside this one.
void draw(const fs::path& folder) {
  const fs::path program = own_directory() / "draw_scenes";
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
  if (!flags.tissue.empty() && std::ranges::find(known, flags.tissue) == known.end())
    throw InputError("--tissue: expected one of " + joined(known) + ", got " + flags.tissue);
  if (!(flags.size_mm >= 0)) throw InputError("--size-mm: expected 0 or more, got " + std::to_string(flags.size_mm));
  const double unit_m = flags.unit == "m" ? 1 : flags.unit == "cm" ? 0.01 : 0.001;
  if (flags.inside.size() > kMaxRegions)
    throw InputError("--inside: at most " + std::to_string(kMaxRegions) + " parts");
  const fs::path folder(flags.out), scene = folder / "scene.yaml";
  if (fs::exists(scene))
    throw InputError("--out: " + scene.string() +
                     " is there already, and may have been edited; remove it, or choose another directory");
  if (!fs::exists(folder)) {  // now, not at the end
    make_directory(flags.out);
    fs::remove(folder);
  }
  std::string parts = flags.part;  // a region belongs to the body that it is in
  if (!parts.empty())
    for (const std::string& inside : flags.inside) parts += "," + inside;
  ImportedMesh organ = import_wrapped(flags.in, unit_m, {parts, 0.001 * flags.size_mm});
  if (const std::string flaw = flaw_of_size(organ.soup.vertices_body_m); !flaw.empty())
    throw InputError("--unit " + flags.unit + ": " + flags.in + ": " + flaw);
  for (const std::string& note : organ.mended) std::printf("%s\n", note.c_str());
  const Box3 box = box_of(organ.soup);
  for (Vec3& p : organ.soup.vertices_body_m) p -= box.center();
  const std::string regions = as_regions(flags, unit_m, box.center());
  make_directory(flags.out);
  write_file((folder / "organ.obj").string(), obj_text(organ.soup, "unit: m"));
  write_file(scene.string(), as_scene(box.sizes(), flags.tissue, regions));
  std::printf("mesh: %s\nscene: %s\n", (folder / "organ.obj").c_str(), scene.c_str());
  draw(folder);
  return 0;
}

}  // namespace

// A file of anatomy, as it comes, to a body: mesh, a scene that runs, and a picture.
Arguments::Action organ_command(Arguments& arguments) {
  const auto flags = std::make_shared<OrganFlags>();
  arguments.option("IN", flags->in, "triangles in any format that assimp reads, or labels in a NIfTI image",
                   Need::required);
  arguments.option("--out", flags->out, "directory for organ.obj, scene.yaml and organ.png", Need::required);
  arguments.option(
      "--part", flags->part,
      "only parts in whose name one of these, apart by commas, is found, or labels of an image; empty: all");
  arguments.option("--inside", flags->inside, "a part or label that is a region inside; may be repeated");
  arguments.option("--size-mm", flags->size_mm, "about the length of an edge; 0: for about 8000 triangles");
  arguments.choice("--unit", flags->unit, {"m", "cm", "mm"}, "length of IN's unit");
  arguments.option("--tissue", flags->tissue, "tissue of the scene's body");
  return [flags] { return make_organ(*flags); };
}

}  // namespace sectio
