#include "sim_server/prepare/fill_volumes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/error.h"
#include "common/mesh/check.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/meshing/fill.h"
#include "sim_server/meshing/lattice_mesher.h"
#include "sim_server/meshing/tet_file.h"

namespace sectio {
namespace {

constexpr double kNearBorder = 2;  // edges of the tetrahedra's lattice

// The distance from the border of a box.
double to_border_m(const Box& box, const Vec3& x_world_m) {
  const Vec3 beyond = (box.min_world_m - x_world_m).cwiseMax(x_world_m - box.max_world_m);
  const double inside = -beyond.maxCoeff();
  return inside > 0 ? inside : beyond.cwiseMax(0).norm();
}

RelaxWhere near_border(const BodySpec& body) {
  if (!body.fixed) return [](const Vec3&) { return false; };
  const double volume_m3 = check_soup(body.mesh).volume_m3;
  return [&body, near_m = kNearBorder * cell_for_tetrahedra(volume_m3, body.volume.tetrahedra)](const Vec3& p) {
    return to_border_m(*body.fixed, body.pose.to_world(p)) < near_m;
  };
}

FilledVolume filled(const BodySpec& body, Filling filling) {
  if (body.volume.file.empty()) {
    FillSettings settings;
    settings.mesher = body.volume.mesher == "tetgen" ? Mesher::tetgen
                      : body.volume.mesher == "best" ? Mesher::best
                                                     : Mesher::lattice;
    settings.tetrahedra = body.volume.tetrahedra;
    settings.material = body.material;
    settings.reports = filling == Filling::whole;
    if (filling == Filling::form) settings.relaxes = near_border(body);
    return fill(body.mesh, settings);
  }
  TetFile file = read_tet_file(body.volume.file, body.volume.file_unit_m);
  if (const std::string flaw = flaw_of_size(file.mesh.vertices_body_m); !flaw.empty())
    throw InputError(body.volume.file + ": " + flaw);
  FilledVolume volume;
  volume.mesh = std::move(file.mesh);
  volume.notes = std::move(file.notes);
  volume.report = report_on(volume.mesh, "file", check(volume.mesh).volume_m3, body.material);
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

// Parts that come off and are smaller are debris, and are removed.
constexpr double kCrumb = 2;            // mean tetrahedra
constexpr double kSurfaceCrumb = 0.06;  // cubes of the mean edge: half of a tetrahedron with such edges

double mean_edge_m(const TriangleSoup& mesh) {
  double sum_m = 0;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      sum_m += (mesh.vertices_body_m[t[(k + 1) % 3]] - mesh.vertices_body_m[t[k]]).norm();
  return mesh.triangles.empty() ? 0 : sum_m / (3 * static_cast<double>(mesh.triangles.size()));
}

void remove_below(double crumb_m3, BodySpec& body) {
  body.splitting.least_volume_m3 = std::max(body.splitting.least_volume_m3, crumb_m3);
}

}  // namespace

void fill_volume(BodySpec& body, Filling filling) {
  if (body.contact.style == "templates")
    throw InputError("contact: templates subdivide a surface; that of a volume stays as it is");
  if (body.cutting.style == "templates")
    throw InputError("cutting: templates cut a surface; a volume is cut progressive or semi_progressive");
  FilledVolume volume = filled(body, filling);
  const TetSurface surface = surface_of(volume.mesh);
  body.tets = with_first(volume.mesh, surface.of_volume);
  body.mesh = surface.soup;
  const double element_m3 = check(body.tets).volume_m3 / static_cast<double>(body.tets.tetrahedra.size());
  remove_below(kCrumb * element_m3, body);
  body.mesh_notes.insert(body.mesh_notes.end(), volume.notes.begin(), volume.notes.end());
  for (const FillReport& report : volume.compared) body.mesh_notes.push_back(to_string(report));
}

Scene fill_volumes(Scene scene, const EngineTable& engines) {
  for (BodySpec& body : scene.bodies) {
    const ModelEntry* model = engines.find_model(body.model);
    if (!model || !body.tets.tetrahedra.empty()) continue;
    try {
      if (model->traits.needs_volume)
        fill_volume(body);
      else
        remove_below(kSurfaceCrumb * std::pow(mean_edge_m(body.mesh), 3), body);
      if (model->prepare) model->prepare(body);
    } catch (const InputError& error) {
      throw InputError(place_of(body, scene) + ": " + error.what());
    }
  }
  return scene;
}

Scene fill_volumes(Scene scene) {
  return fill_volumes(std::move(scene), standard_engines());
}

}  // namespace sectio
