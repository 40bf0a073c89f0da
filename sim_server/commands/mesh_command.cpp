#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "common/core/error.h"
#include "common/core/log.h"
#include "sim_server/commands/commands.h"
#include "sim_server/meshing/fill.h"
#include "sim_server/meshing/tet_file.h"
#include "sim_server/scene/mesh_import.h"
#include "sim_server/volume/tets/tet_cut.h"

namespace sectio {
namespace {

struct Plane {
  Vec3 point_m, normal;
};

// "x,y,z,nx,ny,nz"
Plane plane_of(const std::string& text) {
  std::istringstream in(text);
  std::array<double, 6> n{};
  bool good = true;
  for (std::size_t i = 0; i < 6; ++i) {
    char comma = ',';
    if (i > 0) in >> comma;
    in >> n[i];
    good = good && comma == ',' && in && std::isfinite(n[i]);
  }
  char more = 0;
  const Plane plane{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
  if (!good || in >> more || !(plane.normal.norm() > 0))
    throw InputError("--cut: expected x,y,z,nx,ny,nz with a normal that is not zero, got " + text);
  return plane;
}

FilledVolume volume_of(const std::string& in, double unit_m, const FillSettings& settings) {
  FilledVolume filled;
  if (is_tet_file(in)) {
    TetFile file = read_tet_file(in, unit_m);
    filled.mesh = std::move(file.mesh);
    filled.notes = std::move(file.notes);
    filled.report = report_on(filled.mesh, "file", check(filled.mesh).volume_m3, settings.material);
    filled.compared = {filled.report};
    return filled;
  }
  const ImportedMesh surface = import_mesh(in, unit_m);
  if (const std::string flaw = flaw_of_size(surface.soup.vertices_body_m); !flaw.empty()) log_warning(in + ": " + flaw);
  try {
    filled = fill(surface.soup, settings);
  } catch (const InputError& error) {
    throw InputError(in + ": " + error.what());
  }
  filled.notes.insert(filled.notes.begin(), surface.mended.begin(), surface.mended.end());
  return filled;
}

// Right through, one plane after the other.
TetMesh cut_along(const TetMesh& mesh, const std::vector<Plane>& planes, double snap) {
  Vec3 low = mesh.vertices_body_m[0], high = low;
  for (const Vec3& p : mesh.vertices_body_m) low = low.cwiseMin(p), high = high.cwiseMax(p);
  TetTopology volume(mesh);
  for (const Plane& plane : planes) {
    const double size = 2 * ((high - low).norm() + (plane.point_m - low).norm());
    const Vec3 u = size * plane.normal.unitOrthogonal(), w = size * plane.normal.normalized().cross(u / size);
    const Vec3& at = plane.point_m;
    const TetCutOutcome outcome = cut(volume, {{at - u - w, at + u - w, at + u + w, at - u + w}, {}}, {snap, false});
    std::printf("cut: %u tetrahedra crossed, %u more than before, %u edges split, %u vertices moved to, %u twins\n",
                outcome.crossed, outcome.made, outcome.splits, outcome.snapped, outcome.twins);
  }
  return volume.mesh();
}

void check_values(const FillSettings& settings, double snap) {
  const ElasticMaterial& m = settings.material;
  if (!(settings.tetrahedra >= 12)) throw InputError("--tetrahedra: expected at least 12");
  if (!(m.young_pa > 0)) throw InputError("--young-pa: expected > 0");
  if (!(m.poisson >= 0 && m.poisson < 0.5)) throw InputError("--poisson: expected at least 0 and below 0.5");
  if (!(m.density_kg_per_m3 > 0)) throw InputError("--density-kg-per-m3: expected > 0");
  if (!(snap >= 0 && snap <= 0.3)) throw InputError("--snap: expected in [0, 0.3]");
}

struct MeshFlags {
  std::string in, out, unit = "m", mesher = "lattice";
  std::vector<std::string> cuts;
  double snap = TetCutSettings{}.snap;
  FillSettings settings;
};

int make_mesh(const MeshFlags& flags) {
  FillSettings settings = flags.settings;
  check_values(settings, flags.snap);
  std::vector<Plane> planes;
  for (const std::string& text : flags.cuts) planes.push_back(plane_of(text));
  if (!flags.out.empty()) check_can_write_tets(flags.out);
  settings.mesher = flags.mesher == "lattice"  ? Mesher::lattice
                    : flags.mesher == "tetgen" ? Mesher::tetgen
                                               : Mesher::best;
  FilledVolume filled = volume_of(flags.in, flags.unit == "m" ? 1 : flags.unit == "cm" ? 0.01 : 0.001, settings);
  for (const std::string& note : filled.notes) std::printf("note: %s\n", note.c_str());
  for (const FillReport& report : filled.compared) std::printf("%s\n", to_string(report).c_str());
  if (filled.compared.size() > 1) std::printf("kept: %s\n", filled.report.mesher.c_str());
  if (!planes.empty()) {
    filled.mesh = cut_along(filled.mesh, planes, flags.snap);
    const FillReport after = report_on(filled.mesh, "cut", filled.report.surface_volume_m3, settings.material);
    std::printf("%s, %u parts\n", to_string(after).c_str(), after.tets.components);
  }
  if (!flags.out.empty()) write_tet_file(flags.out, filled.mesh);
  return 0;
}

}  // namespace

// A surface, or tetrahedra from another program, to tetrahedra, cut along planes if asked for, with a report on them.
Arguments::Action mesh_command(Arguments& arguments) {
  const auto flags = std::make_shared<MeshFlags>();
  arguments.option("IN", flags->in, "surface (OBJ, STL, PLY, glTF) or tetrahedra (.msh, .vtk, .node)", Need::required);
  arguments.option("--tets", flags->out, "file for the tetrahedra, in metres: .msh, .vtk or .node (with .ele)");
  arguments.choice("--unit", flags->unit, {"m", "cm", "mm"}, "length of IN's unit");
  arguments.choice("--mesher", flags->mesher, {"lattice", "tetgen", "best"},
                   "best: the one with the larger stable step");
  arguments.option("--tetrahedra", flags->settings.tetrahedra, "about so many");
  arguments.option("--cut", flags->cuts,
                   "cut along a plane: x,y,z,nx,ny,nz, a point in metres and a normal; may be repeated");
  arguments.option("--snap", flags->snap, "a cut goes to vertices within this fraction of an edge");
  arguments.option("--young-pa", flags->settings.material.young_pa, "for the stable step");
  arguments.option("--poisson", flags->settings.material.poisson, "for the stable step");
  arguments.option("--density-kg-per-m3", flags->settings.material.density_kg_per_m3, "for the stable step");
  return [flags] { return make_mesh(*flags); };
}

}  // namespace sectio
