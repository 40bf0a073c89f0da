// A surface as the text of an OBJ file, to a tenth of a micrometre.
#pragma once

#include <string>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

// `comment`: the first line, without its #.
std::string obj_text(const TriangleSoup& soup, const std::string& comment);

}  // namespace sectio
