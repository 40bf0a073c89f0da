// Damage to bytes on a wire: flipped, cut, lengthened, and lengths within them that lie.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/support/random.h"

namespace sectio::test {

std::vector<std::uint8_t> damaged(std::vector<std::uint8_t> bytes, test::Random& random);

}  // namespace sectio::test
