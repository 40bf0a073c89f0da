// Counts what operator new gives, thread by thread, in the executable that links this.
#pragma once

#include <cstdint>

namespace sectio {

std::uint64_t allocations_of_this_thread();

}  // namespace sectio
