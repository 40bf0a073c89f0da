#include "sim_server/meshing/fill.h"

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/mesh/check.h"
#include "sim_server/meshing/lattice_mesher.h"
#include "sim_server/meshing/tetgen.h"

namespace sectio {
namespace {

TetMesh lattice(const TriangleSoup& surface, double volume_m3, const FillSettings& settings,
                std::vector<std::string>& notes) {
  double cell_m = cell_for_tetrahedra(volume_m3, settings.tetrahedra);
  for (int tries = 4;; --tries) {
    try {
      return fill_with_lattice(surface, cell_m, settings.relaxes);
    } catch (const InputError& error) {
      if (tries == 0) throw;
      notes.push_back(std::string("lattice: ") + error.what());
      cell_m *= 0.8;
    }
  }
}

}  // namespace

FillReport report_on(const TetMesh& mesh, const std::string& mesher, double surface_volume_m3,
                     const ElasticMaterial& material) {
  return {mesher, check(mesh), surface_volume_m3, explicit_step_limit_s(mesh, material)};
}

FilledVolume fill(const TriangleSoup& surface, const FillSettings& settings) {
  const SurfaceReport outside = check_soup(surface);
  if (!outside.valid()) throw InputError("the surface can't be filled: " + outside.first_defect);
  if (!(outside.volume_m3 > 0)) throw InputError("the surface can't be filled: it is inside out");
  FilledVolume best;
  if (settings.mesher == Mesher::lattice && !settings.reports) {
    best.mesh = lattice(surface, outside.volume_m3, settings, best.notes);
    return best;
  }
  const auto compare = [&](TetMesh mesh, const char* name) {
    best.compared.push_back(report_on(mesh, name, outside.volume_m3, settings.material));
    if (best.compared.back().stable_step_s <= best.report.stable_step_s) return;
    best.report = best.compared.back();
    best.mesh = std::move(mesh);
  };
  if (settings.mesher != Mesher::tetgen) compare(lattice(surface, outside.volume_m3, settings, best.notes), "lattice");
  if (settings.mesher == Mesher::lattice) return best;
  // TetGen bounds the largest volume; the mean is about 0.6 of the largest.
  const double largest_m3 = outside.volume_m3 / settings.tetrahedra / 0.6;
  try {
    compare(fill_with_tetgen(surface, largest_m3, settings.tetgen_limit_s), "tetgen");
  } catch (const InputError& error) {
    if (settings.mesher == Mesher::tetgen) throw;
    best.notes.push_back(error.what());
  }
  return best;
}

std::string to_string(const FillReport& r) {
  return formatted(
      "%s: %u tetrahedra, %u vertices, smallest dihedral angle %.1f deg, volume %.4f of the surface's, stable "
      "step %.4g ms",
      r.mesher.c_str(), r.tets.tetrahedra, r.tets.vertices, r.tets.smallest_dihedral_deg,
      r.tets.volume_m3 / r.surface_volume_m3, 1e3 * r.stable_step_s);
}

}  // namespace sectio
