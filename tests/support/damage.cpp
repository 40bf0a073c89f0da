#include "tests/support/damage.h"
#include "tests/support/random.h"

namespace sectio::test {

std::vector<std::uint8_t> damaged(std::vector<std::uint8_t> bytes, test::Random& random) {
  const unsigned flips = 1 + random() % 4;
  for (unsigned i = 0; i < flips && !bytes.empty(); ++i) {
    std::uint8_t& byte = bytes[random() % bytes.size()];
    byte = random() % 3 == 0 ? 0xff : static_cast<std::uint8_t>(random());
  }
  if (random() % 4 == 0) bytes.resize(random() % (bytes.size() + 16));
  if (random() % 8 == 0 && bytes.size() >= 8) {  // lengths are whole words
    const std::size_t word = random() % (bytes.size() / 4) * 4;
    for (std::size_t i = 0; i < 4; ++i) bytes[word + i] = i < 3 || random() % 2 ? 0xff : 0;
  }
  return bytes;
}

}  // namespace sectio::test
