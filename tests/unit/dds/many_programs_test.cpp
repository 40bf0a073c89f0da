#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <memory>
#include <set>
#include <thread>
#include <vector>

#include "common/core/error.h"
#include "common/dds/participant.h"
#include "common/dds/program_number.h"

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

// Programs that start at the same moment, of which none has opened its port yet.
TEST(Participants, D_9_programs_that_start_together_have_different_numbers) {
  constexpr int kPrograms = 12;
  NetworkOptions options;
  options.domain = 101 + static_cast<std::uint32_t>(getpid()) % 100;
  std::array<int, 2> said{}, over{};
  ASSERT_EQ(pipe(said.data()), 0);
  ASSERT_EQ(pipe(over.data()), 0);
  std::vector<pid_t> programs;
  for (int i = 0; i < kPrograms; ++i) {
    programs.push_back(fork());
    if (programs.back() > 0) continue;
    close(over[1]);
    const ProgramNumber number(options);
    const std::int32_t value = number.value();
    char none = 0;
    const bool told = write(said[1], &value, sizeof value) == sizeof value && read(over[0], &none, 1) == 0;
    _exit(told ? 0 : 1);
  }
  std::set<std::int32_t> numbers;
  for (int i = 0; i < kPrograms; ++i) {
    std::int32_t value = -1;
    ASSERT_EQ(read(said[0], &value, sizeof value), static_cast<ssize_t>(sizeof value));
    numbers.insert(value);
  }
  EXPECT_EQ(numbers.size(), kPrograms);
  close(over[1]);
  for (const pid_t program : programs) {
    int status = 0;
    EXPECT_EQ(waitpid(program, &status, 0), program);
    EXPECT_EQ(status, 0);
  }
  for (const int end : {said[0], said[1], over[0]}) close(end);
}

}  // namespace
}  // namespace sectio::dds_test
