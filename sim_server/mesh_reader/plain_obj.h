// The text of an OBJ file, made plain for assimp. Assimp takes the beginning of a word for a number ("0.1m", "1d-1"),
// leaves out a vertex that has none in its place, and gets numbers of many digits wrong, all without a word.
#pragma once

#include <string>

namespace sectio {

// A text in which each coordinate is one that assimp reads rightly; empty: the file itself is such a text. Throws
// std::runtime_error "line 7: what is wrong" for coordinates that are no numbers and for faces without their vertices.
std::string plain_obj(const std::string& path);

}  // namespace sectio
