// Tetrahedra from and to files: Gmsh's .msh (ASCII, versions 2.2 and 4.1), legacy .vtk (ASCII), TetGen's .node and
// .ele.
#pragma once

#include <string>
#include <vector>

#include "common/mesh/tet_mesh.h"

namespace sectio {

struct TetFile {
  TetMesh mesh;                    // in metres; passes check() of common/mesh/tet_mesh.h
  std::vector<std::string> notes;  // what was left out or mended, for a person; often empty
};

// Whether the name ends as one of these formats does (.node and .ele stand for both).
bool is_tet_file(const std::string& path);

// Elements that are not tetrahedra and vertices of none are left out; files that count corners the other way round are
// turned as a whole. Throws InputError "FILE:LINE: reason" for damaged files, and "FILE: reason, place" for tetrahedra
// that can't serve: inverted, overlapping or not conforming. Files above 1 GB are refused. Any thread.
TetFile read_tet_file(const std::string& path, double unit_m);

// In metres. Throws InputError when the file can't be written or its name has another ending.
void write_tet_file(const std::string& path, const TetMesh& mesh);

}  // namespace sectio
