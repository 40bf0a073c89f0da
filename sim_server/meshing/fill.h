// Fills a surface with tetrahedra by the chosen mesher, and reports on the result.
#pragma once

#include <string>
#include <vector>

#include "common/mesh/tet_mesh.h"
#include "sim_server/meshing/relax.h"
#include "sim_server/meshing/stable_step.h"

namespace sectio {

enum class Mesher {
  lattice,
  tetgen,
  best,  // runs both, if tetgen is installed, and keeps the mesh with the larger stable step
};

struct FillSettings {
  Mesher mesher = Mesher::lattice;
  double tetrahedra = 8000;  // approximate number
  ElasticMaterial material;
  double tetgen_limit_s = 60;
  RelaxWhere relaxes = {};  // the lattice mesher does so there; elsewhere: a tenth of the time, and the same form
  bool reports = true;      // false: the lattice mesher's mesh alone, in half the time
};

struct FillReport {
  std::string mesher;  // "lattice", "tetgen" or, from a file, "file"
  TetReport tets;
  double surface_volume_m3 = 0;
  double stable_step_s = 0;
};

struct FilledVolume {
  TetMesh mesh;
  FillReport report;                 // on `mesh`
  std::vector<FillReport> compared;  // one for every mesher that was tried, in order
  std::vector<std::string> notes;    // for a person, e.g. why a mesher failed
};

// Throws InputError as the meshers do (lattice_mesher.h, tetgen.h). If the lattice's cells can't follow the surface,
// they are made smaller by a fifth, up to four times.
FilledVolume fill(const TriangleSoup& surface, const FillSettings& settings);

// Reports on given tetrahedra.
FillReport report_on(const TetMesh& mesh, const std::string& mesher, double surface_volume_m3,
                     const ElasticMaterial& material);

// One line: "lattice: 11325 tetrahedra, 2500 vertices, smallest dihedral angle 18.5 deg, ...".
std::string to_string(const FillReport& report);

}  // namespace sectio
