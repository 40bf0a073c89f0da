// The identity of the program's build: the linker's hash of all that is in it. Bytes that only the program itself can
// read carry it.
#pragma once

#include <string>

namespace sectio {

// Hexadecimal; empty when the linker left none.
const std::string& program_id();

}  // namespace sectio
