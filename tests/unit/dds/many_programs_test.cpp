#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "common/core/error.h"
#include "common/dds/participant.h"

namespace sectio::dds_test {
namespace {

TEST(Participants, D_9_forty_programs_of_one_host_find_each_other_and_the_sixty_fifth_is_refused) {
  constexpr std::size_t kPrograms = 40, kMost = 64;
  NetworkOptions options;
  options.domain = 1 + static_cast<std::uint32_t>(getpid()) % 100;
  options.session = "many-" + std::to_string(getpid());
  std::vector<std::unique_ptr<Participant>> programs;
  for (std::size_t i = 0; i < kPrograms; ++i)
    programs.push_back(std::make_unique<Participant>(options, "program " + std::to_string(i)));
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  for (const auto& program : programs) {
    while (program->peers().size() < kPrograms - 1 && std::chrono::steady_clock::now() < give_up)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_GE(program->peers().size(), kPrograms - 1);
  }
  for (std::size_t i = kPrograms; i < kMost; ++i)
    programs.push_back(std::make_unique<Participant>(options, "program " + std::to_string(i)));
  try {
    const Participant one_more(options, "one more");
    ADD_FAILURE() << "it would find nobody";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("64 programs of this host are on it"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace sectio::dds_test
