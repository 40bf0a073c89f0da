// From a surface to tetrahedra by the mesher asked for, with a report of what came out.
#pragma once

#include <string>
#include <vector>

#include "common/mesh/tet_mesh.h"
#include "sim_server/meshing/stable_step.h"

namespace sectio {

enum class Mesher {
  lattice,
  tetgen,
  best,  // both, as far as tetgen is installed, and the one with the larger stable step is kept
};

struct FillSettings {
  Mesher mesher = Mesher::lattice;
  double tetrahedra = 8000;  // about so many
  ElasticConstants material;
  double tetgen_limit_s = 60;
};

struct FillReport {
  std::string mesher;  // "lattice", "tetgen" or, from a file, "file"
  TetReport tets;
  double surface_volume_m3 = 0;
  double stable_step_s = 0;
};

struct FilledVolume {
  TetMesh mesh;
  FillReport report;                 // of mesh
  std::vector<FillReport> compared;  // of every mesher that was tried, in order
  std::vector<std::string> notes;    // e.g. why one failed
};

// Throws InputError as the meshers do (lattice_mesher.h, tetgen.h). The lattice's cells are made smaller, up to four
// times by a fifth, where they can't follow the surface.
FilledVolume fill(const TriangleSoup& surface, const FillSettings& settings);

// Of tetrahedra that were given.
FillReport report_on(const TetMesh& mesh, const std::string& mesher, double surface_volume_m3,
                     const ElasticConstants& material);

// One line: "lattice: 11325 tetrahedra, 2500 vertices, smallest dihedral angle 18.5 deg, ...".
std::string to_string(const FillReport& report);

}  // namespace sectio
