// Damage to bytes on a wire: flipped, cut, lengthened, and lengths within them that lie.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

namespace sectio::test {

std::vector<std::uint8_t> damaged(std::vector<std::uint8_t> bytes, std::mt19937& random);

}  // namespace sectio::test
