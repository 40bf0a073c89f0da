#include "sim_server/prepare/fill_volumes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/core/error.h"
#include "common/mesh/check.h"
#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/meshing/fill.h"
#include "sim_server/meshing/tet_file.h"
#include "sim_server/volume/volume_material.h"

namespace sectio {
namespace {

ElasticConstants elastic_constants(const MaterialSpec& m) {
  return {m.young_pa, m.poisson, m.density_kg_per_m3};
}

FilledVolume filled(const BodySpec& body) {
  if (body.volume.file.empty()) {
    FillSettings settings;
    settings.mesher = body.volume.mesher == "tetgen" ? Mesher::tetgen
                      : body.volume.mesher == "best" ? Mesher::best
                                                     : Mesher::lattice;
    settings.tetrahedra = body.volume.tetrahedra;
    settings.material = elastic_constants(body.material);
    return fill(body.mesh, settings);
  }
  TetFile file = read_tet_file(body.volume.file, body.volume.file_unit_m);
  FilledVolume volume;
  volume.mesh = std::move(file.mesh);
  volume.notes = std::move(file.notes);
  volume.report = report_on(volume.mesh, "file", check(volume.mesh).volume_m3, elastic_constants(body.material));
  volume.compared = {volume.report};
  return volume;
}

// The volume renumbered: these vertices first, then the others in their order.
TetMesh with_first(const TetMesh& mesh, std::span<const VertexId> first) {
  TetMesh out;
  std::vector<VertexId> number(mesh.vertices_body_m.size(), kNone);
  const auto take = [&](VertexId v) {
    if (number[v] != kNone) return;
    number[v] = static_cast<VertexId>(out.vertices_body_m.size());
    out.vertices_body_m.push_back(mesh.vertices_body_m[v]);
  };
  for (const VertexId v : first) take(v);
  for (VertexId v = 0; v < number.size(); ++v) take(v);
  for (const Tetrahedron& t : mesh.tetrahedra)
    out.tetrahedra.push_back({number[t[0]], number[t[1]], number[t[2]], number[t[3]]});
  return out;
}

constexpr double kCrumb = 0.5;   // of a mean tetrahedron: what comes off and is smaller is removed
constexpr double kCells = 2000;  // in a body whose scene doesn't say how large they are

std::string note_on(const HexSolid& solid) {
  char text[240];
  std::snprintf(text, sizeof text,
                "hexahedra: %zu of %.2g mm, %zu nodes, stable step %.3g ms at rest, which no cut makes shorter",
                solid.lattice().cells.size(), 1e3 * solid.lattice().grid.cell_m, solid.lattice().nodes.size(),
                1e3 * solid.explicit_limit_s());
  return text;
}

void make_volume(BodySpec& body) {
  if (body.contact.style == "templates")
    throw InputError("contact: templates subdivide a surface; that of a volume stays as it is");
  if (body.cutting.style == "templates")
    throw InputError("cutting: templates cut a surface; a volume is cut progressive or semi_progressive");
  FilledVolume volume = filled(body);
  const TetSurface surface = surface_of(volume.mesh);
  body.tets = with_first(volume.mesh, surface.of_volume);
  body.mesh = surface.soup;
  const double element_m3 = check(body.tets).volume_m3 / static_cast<double>(body.tets.tetrahedra.size());
  body.splitting.least_volume_m3 = std::max(body.splitting.least_volume_m3, kCrumb * element_m3);
  body.mesh_notes.insert(body.mesh_notes.end(), volume.notes.begin(), volume.notes.end());
  for (const FillReport& report : volume.compared) body.mesh_notes.push_back(to_string(report));
  if (body.model == "neo_hookean_lattice") {
    if (body.volume.cell_m == 0) body.volume.cell_m = std::cbrt(check(body.tets).volume_m3 / kCells);
    body.mesh_notes.push_back(note_on(HexSolid(body.tets, grid_around(body.tets, body.volume.cell_m),
                                               volume_material(body.material), {}, driver_of(body))));
  }
  if (body.model != "tetra_springs") return;
  const TetSprings springs(body.tets, volume_material(body.material), {}, {body.volume.second_share, 0, true});
  char text[240];
  std::snprintf(
      text, sizeof text,
      "springs: Young's modulus %.0f Pa before a correction to %.0f Pa; Poisson's ratio %.2f instead of %.2f: a "
      "net of springs has at most 0.25",
      springs.as_made().mean_young_pa, springs.calibrated().mean_young_pa, springs.calibrated().mean_poisson,
      body.material.poisson);
  body.mesh_notes.emplace_back(text);
}

}  // namespace

Scene fill_volumes(Scene scene) {
  for (BodySpec& body : scene.bodies) {
    if (!body.tets.tetrahedra.empty() || body.model == "surface_springs" ||
        !standard_engines().models.contains(body.model))
      continue;
    try {
      make_volume(body);
    } catch (const InputError& error) {
      throw InputError(scene.file + ": body '" + body.name + "': " + error.what());
    }
  }
  return scene;
}

}  // namespace sectio
