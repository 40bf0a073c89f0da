// Reads and writes files of tetrahedra: Gmsh's .msh (ASCII, versions 2.2 and 4.1), legacy .vtk (ASCII), TetGen's .node
// and .ele.
#pragma once

#include <string>
#include <vector>

#include "common/mesh/tet_mesh.h"

namespace sectio {

struct TetFile {
  TetMesh mesh;                    // in metres; passes check() of common/mesh/tet_mesh.h
  std::vector<std::string> notes;  // for a person: elements left out and defects mended; often empty
};

// Whether the name has the ending of one of these formats (.node and .ele stand for both files).
bool is_tet_file(const std::string& path);

// Leaves out elements that are not tetrahedra, and vertices that no tetrahedron uses. If a file orients all tetrahedra
// the other way round, it is turned as a whole. Throws InputError "FILE:LINE: reason" for damaged files, and "FILE:
// reason, place" for tetrahedra that are inverted, overlap or don't conform. Refuses files above 1 GB. Any thread.
TetFile read_tet_file(const std::string& path, double unit_m);

// Writes metres: a whole file, or none. Throws InputError when the file can't be written or its name has another
// ending; check_can_write_tets() throws the same before there is anything to write.
void check_can_write_tets(const std::string& path);
void write_tet_file(const std::string& path, const TetMesh& mesh);

}  // namespace sectio
