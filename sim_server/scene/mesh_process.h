// Reading of mesh files in a child process (the program mesh_reader), so that a damaged or hostile file can neither
// hang nor crash the caller.
#pragma once

#include <cstdint>
#include <string>

#include "common/mesh/triangle_mesh.h"
#include "sim_server/scene/mesh_import.h"

namespace sectio {

// First bytes of what mesh_reader writes to its descriptor kMeshPipe: the header, then 3 doubles a vertex, then 3
// vertex numbers a triangle; or, where status is not 0, `vertices` bytes of text that says why not. Host byte order.
struct MeshPipeHeader {
  std::uint64_t magic = 0x6873656d6f636573;
  std::uint64_t status = 0;
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
};
constexpr int kMeshPipe = 3;

// The triangles as they are in the file, in its unit: nothing is welded or checked but that numbers are finite and
// corners name vertices. Throws InputError "FILE: reason". Any thread.
struct MeshChoice {
  // Only nodes and meshes in whose name one of these, apart by commas, is found, whatever its case; of a NIfTI image,
  // only voxels with one of these labels. Empty: all.
  std::string part = {};
  bool any_format = false;  // every format that assimp knows, and NIfTI
};
TriangleSoup read_mesh_file(const std::string& path, const ImportLimits& limits, const MeshChoice& choice = {});

}  // namespace sectio
