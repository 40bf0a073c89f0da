#include "common/core/write_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/core/error.h"

namespace sectio::core_test {
namespace {

namespace fs = std::filesystem;

class WriteFile : public testing::Test {
 protected:
  WriteFile() { fs::create_directories(folder); }
  ~WriteFile() override { fs::remove_all(folder); }

  std::string path(const std::string& name) const { return (folder / name).string(); }
  static std::string read(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
  }
  static std::string refusal(const auto& write) {
    try {
      write();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  const fs::path folder = fs::temp_directory_path() / ("sectio_write_file_" + std::to_string(::getpid()));
};

// Files of this process can't grow beyond a size.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) : handler_(::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  sighandler_t handler_;
};

TEST_F(WriteFile, replaces_a_file_as_a_whole) {
  const std::string file = path("größe von liver.obj");
  write_file(file, "first, and longer");
  write_file(file, "second");
  EXPECT_EQ(read(file), "second");
  EXPECT_EQ(files(), 1u);
}

TEST_F(WriteFile, leaves_nothing_half_written_on_a_full_disk) {
  const std::string kept = path("kept"), fresh = path("fresh");
  write_file(kept, "before");
  {
    const SmallDisk disk(1000);
    for (const std::string& file : {kept, fresh})
      EXPECT_EQ(refusal([&] { write_file(file, std::string(1001, 'x')); }),
                file + ": can't be written: File too large");
  }
  EXPECT_EQ(read(kept), "before");
  EXPECT_EQ(files(), 1u);
}

TEST_F(WriteFile, says_where_there_is_no_way) {
  const std::string file = path("no/such/folder");
  EXPECT_EQ(refusal([&] { write_file(file, "x"); }), file + ": can't be written: No such file or directory");
  EXPECT_EQ(refusal([&] { check_can_write(file); }), file + ": can't be written: No such file or directory");
  EXPECT_EQ(refusal([&] { check_can_write(folder.string()); }), folder.string() + ": can't be written: Is a directory");
  EXPECT_EQ(refusal([&] { check_can_write(path("yes")); }), "");
  EXPECT_EQ(files(), 0u);
}

TEST_F(WriteFile, writes_to_what_is_no_file) {
  EXPECT_EQ(refusal([] { write_file("/dev/full", "x"); }), "/dev/full: can't be written: No space left on device");
  write_file("/dev/null", "x");
  check_can_write("/dev/null");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(WriteFile, follows_a_link) {
  fs::create_directory(folder / "elsewhere");
  fs::create_symlink(folder / "elsewhere/report.json", folder / "report.json");
  for (const char* text : {"first", "second"}) {
    write_file(path("report.json"), text);
    EXPECT_TRUE(fs::is_symlink(folder / "report.json"));
    EXPECT_EQ(read(path("elsewhere/report.json")), text);
  }
}

}  // namespace
}  // namespace sectio::core_test
