#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <vector>

#include "common/messages/codec.h"
#include "tests/support/damage.h"
#include "tests/unit/dds/messages.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace sectio {
namespace {

using Input = std::vector<std::uint8_t>;

// In the order of the kinds of fuzz_messages.cpp.
std::vector<Input> seeds() {
  std::vector<Input> all;
  const auto add = [&](const auto& message) {
    const std::vector<std::uint8_t> bytes = encode(message);
    Input input{static_cast<std::uint8_t>(all.size()), static_cast<std::uint8_t>(bytes.size() & 0xff),
                static_cast<std::uint8_t>(bytes.size() >> 8)};
    input.insert(input.end(), bytes.begin(), bytes.end());
    all.push_back(input);
  };
  add(test::some_packet());
  add(test::some_wish());
  add(test::some_contact());
  add(test::some_delta());
  add(test::some_chunk());
  add(test::some_request());
  add(test::some_header());
  add(test::some_piece());
  add(test::some_scalars());
  add(test::some_scene());
  add(test::some_event());
  add(test::some_status());
  add(test::some_order());
  add(test::some_end());
  add(test::some_report());
  add(test::some_inputs());
  add(test::some_step_request());
  return all;
}

void run(const Input& input) {
  LLVMFuzzerTestOneInput(input.data(), input.size());
}

TEST(FuzzCorpus, every_input_goes_through_the_readers) {
  int inputs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SECTIO_SOURCE_DIR "/tests/fuzz/corpus")) {
    std::ifstream file(entry.path(), std::ios::binary);
    run({std::istreambuf_iterator<char>(file), {}});
    ++inputs;
  }
  EXPECT_GT(inputs, 16);
}

// Valid messages of every kind, some after one another, damaged in all the ways of damage.h.
TEST(FuzzCorpus, a_hundred_thousand_damaged_messages_harm_no_reader) {
  const std::vector<Input> whole = seeds();
  std::mt19937 random(11);
  for (int i = 0; i < 100'000; ++i) {
    Input input;
    for (auto messages = 1 + random() % 3; messages > 0; --messages) {
      const Input& seed = whole[random() % whole.size()];
      const Input one = random() % 4 == 0 ? seed : test::damaged(seed, random);
      input.insert(input.end(), one.begin(), one.end());
    }
    run(input);
  }
}

// The corpus begins with these: SECTIO_FUZZ_SEEDS names the directory that they are written into.
TEST(FuzzCorpus, seeds_can_be_written) {
  const char* directory = std::getenv("SECTIO_FUZZ_SEEDS");
  if (directory == nullptr) GTEST_SKIP() << "SECTIO_FUZZ_SEEDS names no directory";
  const std::vector<Input> all = seeds();
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::ofstream file(std::string(directory) + "/seed_" + std::to_string(i), std::ios::binary);
    file.write(reinterpret_cast<const char*>(all[i].data()), static_cast<std::streamsize>(all[i].size()));
  }
}

}  // namespace
}  // namespace sectio
