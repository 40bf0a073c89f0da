#include "common/core/child_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <system_error>

namespace sectio::test {
namespace {

TEST(ChildProcess, a_program_that_ends_says_how) {
  EXPECT_TRUE(ChildProcess({"true"}).wait().well);
  ChildProcess child({"sh", "-c", "exit 3"});
  const auto ending = child.wait();
  EXPECT_FALSE(ending.well);
  EXPECT_EQ(ending.text, "ended with code 3");
  EXPECT_EQ(child.wait().text, ending.text) << "asked again";
  EXPECT_NE(ChildProcess({"sh", "-c", "kill -SEGV $$"}).wait().text.find("crashed"), std::string::npos);
}

TEST(ChildProcess, a_program_that_is_not_there_is_an_error_with_its_name) {
  try {
    ChildProcess child({"no_such_program_anywhere"});
    FAIL() << "it has begun";
  } catch (const std::system_error& error) {
    EXPECT_NE(std::string(error.what()).find("no_such_program_anywhere"), std::string::npos);
    EXPECT_EQ(error.code().value(), ENOENT);
  }
}

TEST(ChildProcess, waiting_has_a_bound) {
  ChildProcess child({"sleep", "1000"});
  EXPECT_FALSE(child.wait_for(0.01));
  child.kill();
  const auto ending = child.wait_for(60);
  ASSERT_TRUE(ending);
  EXPECT_FALSE(ending->well);
}

// The child writes its process number, which is nobody's once the object is gone.
TEST(ChildProcess, none_is_left_behind) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  pid_t pid = 0;
  {
    ChildProcess child({"sh", "-c", "echo $$ >&7; exec sleep 1000"}, {.descriptors = {{ends[1], 7}}});
    std::array<char, 20> said{};
    ASSERT_GT(::read(ends[0], said.data(), said.size() - 1), 0);
    pid = std::atoi(said.data());
    ASSERT_GT(pid, 1);
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_EQ(::kill(pid, 0), -1);
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST(ChildProcess, a_child_gets_no_descriptor_that_is_not_named) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), 0), 0);  // not closed by exec
  const std::string look = "test ! -e /proc/self/fd/" + std::to_string(ends[1]);
  EXPECT_TRUE(ChildProcess({"sh", "-c", look}).wait().well);
  ::close(ends[0]);
  ::close(ends[1]);
}

}  // namespace
}  // namespace sectio::test
