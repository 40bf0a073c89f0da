// Files that a run leaves in its directory.
#pragma once

#include <span>
#include <string>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

// All throw InputError "PATH: why" when it can't be done.
void make_directory(const std::string& path);
void write_text(const std::string& path, const std::string& text);
// Wavefront OBJ of the live surface, skin and wall as groups, in metres.
void write_obj(const std::string& path, const TriangleMesh& mesh, std::span<const Vec3f> positions_world_m);

// DIRECTORY/BODY.obj
std::string obj_path(const std::string& directory, const std::string& body);

}  // namespace sectio
