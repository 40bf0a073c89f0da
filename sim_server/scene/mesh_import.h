// Surfaces from files: Wavefront OBJ, STL, PLY, glTF and GLB. Flaws that can be mended without guessing are mended
// (duplicate vertices, degenerate and duplicate triangles, orientation); a surface that can't serve is refused with the
// reason and the place.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/mesh/check.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

// The file is read by a child process within these limits: some readers crash or never end on damaged files.
struct ImportLimits {
  double time_s = 60;
  std::uint64_t memory_bytes = 3'000'000'000;  // largest memory of the child
  std::uint64_t file_bytes = 1'000'000'000;
  std::uint32_t triangles = 5'000'000;
};

struct ImportedMesh {
  TriangleSoup soup;                // in metres; a closed, oriented manifold without self-intersection, outside outward
  SurfaceReport report;             // report on `soup`
  std::vector<std::string> mended;  // notes for a person on how the file's triangles were mended; often empty
};

// The part of a file that is wanted for a body that is wrapped around it (sim_server/wrap/wrap.h).
struct WrapRequest {
  std::string part;   // MeshChoice::part (mesh_process.h)
  double size_m = 0;  // 0: for about 8000 triangles
};

// Like import_mesh(), from a file of any format that assimp reads, whose triangles may be open, doubled, crossing
// themselves or in many parts, or from labels in a NIfTI image, whose unit must be m, too. A body with walls
// thinner than the size is filled up, and a note says so.
ImportedMesh import_wrapped(const std::string& path, double unit_m, const WrapRequest& request,
                            const ImportLimits& limits = {});

// unit_m: the length in metres of the file's unit. glTF is in metres by its definition: then unit_m must be 1.
// Throws InputError "FILE: reason, place". Any thread.
ImportedMesh import_mesh(const std::string& path, double unit_m, const ImportLimits& limits = {});

}  // namespace sectio
