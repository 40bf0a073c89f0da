#include "common/core/arguments.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "common/core/error.h"

namespace sectio::core_test {
namespace {

struct Command {
  std::string scene;
  double duration_s = 5;
  std::uint32_t tool_id = 0;
  std::uint64_t steps = 0;
  int display = 0;
  std::vector<std::string> peers;
  std::string device = "scripted";
  bool quiet = false;

  bool parse(std::vector<const char*> argv) {
    Arguments arguments("tester", "Tests the command line");
    arguments.option("--scene", scene, "the scene", Need::required);
    arguments.option("--duration-s", duration_s, "time to run");
    arguments.option("--tool-id", tool_id, "index of the tool");
    arguments.option("--steps", steps, "how many");
    arguments.option("--display", display, "which one");
    arguments.option("--peer", peers, "address of a peer; may be repeated");
    arguments.choice("--device", device, {"scripted", "virtual_hand"}, "device");
    arguments.toggle("--quiet", quiet, "no progress");
    argv.insert(argv.begin(), "tester");
    return arguments.parse(static_cast<int>(argv.size()), argv.data());
  }
};

TEST(Arguments, fills_every_kind) {
  Command c;
  ASSERT_TRUE(c.parse({"--scene", "a.yaml", "--duration-s", "2.5", "--tool-id", "3", "--peer", "x", "--peer", "y",
                       "--device", "virtual_hand", "--quiet"}));
  EXPECT_EQ(c.scene, "a.yaml");
  EXPECT_EQ(c.duration_s, 2.5);
  EXPECT_EQ(c.tool_id, 3U);
  EXPECT_EQ(c.peers, (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(c.device, "virtual_hand");
  EXPECT_TRUE(c.quiet);
}

TEST(Arguments, whole_numbers_are_decimal_up_to_the_largest) {
  Command c;
  ASSERT_TRUE(c.parse({"--scene", "a", "--steps", "18446744073709551615", "--tool-id", "010", "--display", "-1"}));
  EXPECT_EQ(c.steps, 18446744073709551615u);
  EXPECT_EQ(c.tool_id, 10u);
  EXPECT_EQ(c.display, -1);
}

TEST(Arguments, defaults_stay) {
  Command c;
  ASSERT_TRUE(c.parse({"--scene", "a.yaml"}));
  EXPECT_EQ(c.duration_s, 5);
  EXPECT_EQ(c.device, "scripted");
  EXPECT_TRUE(c.peers.empty());
}

TEST(Arguments, bad_flags_throw_one_line_that_names_them) {
  const std::vector<std::pair<std::vector<const char*>, std::string>> cases{
      {{}, "--scene"},
      {{"--scene", ""}, "--scene"},
      {{"--scene="}, "--scene"},
      {{"--scene", "a", "--sceen", "b"}, "--sceen"},
      {{"--sceen", "b"}, "--sceen"},
      {{"--scene", "a", "--log-level", "loud"}, "--log-level"},
      {{"--scene", "a", "--duration-s", "soon"}, "--duration-s"},
      {{"--scene", "a", "--duration-s", "nan"}, "--duration-s"},
      {{"--scene", "a", "--tool-id", "-1"}, "--tool-id"},
      {{"--scene", "a", "--steps", "-5"}, "--steps"},
      {{"--scene", "a", "--steps", "99999999999999999999"}, "--steps"},
      {{"--scene", "a", "--steps", "18446744073709551616"}, "--steps"},
      {{"--scene", "a", "--steps", "1e3"}, "--steps"},
      {{"--scene", "a", "--steps", "3.5"}, "--steps"},
      {{"--scene", "a", "--steps", "0x10"}, "--steps"},
      {{"--scene", "a", "--steps", ""}, "--steps"},
      {{"--scene", "a", "--steps", " 5"}, "--steps"},
      {{"--scene", "a", "--tool-id", "4294967296"}, "--tool-id"},
      {{"--scene", "a", "--display", "2147483648"}, "--display"},
      {{"--scene", "a", "--display", "-99999999999999999999"}, "--display"},
      {{"--scene", "a", "--duration-s", "1e999"}, "--duration-s"},
      {{"--scene", "a", "--device", "mouse"}, "--device"},
  };
  for (const auto& [argv, flag] : cases) {
    Command c;
    try {
      (void)c.parse(argv);
      ADD_FAILURE() << flag << " was accepted";
    } catch (const InputError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(flag), std::string::npos) << text;
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    }
  }
}

struct Program {
  std::string scene, journal;
  std::string ran;

  int run(std::vector<const char*> argv) {
    Arguments arguments("tester", "Tests commands");
    arguments.option("--scene", scene, "the scene", Need::required);
    arguments.command("replay", "rebuilds a session", [this](Arguments& replay) {
      replay.option("JOURNAL", journal, "journal", Need::required);
      return [this] {
        ran = "replay";
        return 3;
      };
    });
    argv.insert(argv.begin(), "tester");
    return arguments.run(static_cast<int>(argv.size()), argv.data(), [this] {
      ran = "session";
      return 4;
    });
  }

  std::string refusal(const std::vector<const char*>& argv) {
    try {
      run(argv);
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  }
};

TEST(Arguments, words_that_cannot_be_printed_are_refused_without_printing_them) {
  for (const char* const word : {"M\xfcller", "a\tb", "a\nb", "\xc3", "\xed\xa0\x80", "\x7f"}) {
    Command c;
    try {
      c.parse({"--scene", word});
      ADD_FAILURE() << word;
    } catch (const InputError& error) {
      EXPECT_STREQ(error.what(), "--scene: expected text that can be printed, in UTF-8");
    }
  }
  Command c;
  EXPECT_TRUE(c.parse({"--scene", "M\xc3\xbcller \xe8\x82\x9d.yaml"}));
}

TEST(Arguments, the_nearest_known_flag_or_command_is_named) {
  Program p;
  EXPECT_EQ(p.refusal({"--sceen", "a"}), "not expected: --sceen a; did you mean --scene?");
  EXPECT_EQ(p.refusal({"--sceen=a"}), "not expected: --sceen=a; did you mean --scene?");
  EXPECT_EQ(p.refusal({"replai"}), "unknown command: replai; did you mean replay?");
  EXPECT_EQ(p.refusal({"liver.yaml"}), "unknown command: liver.yaml (see --help)");
  const std::string file = SECTIO_SOURCE_DIR "/README.md";
  EXPECT_EQ(p.refusal({file.c_str()}), "not expected: " + file + ", a file without its flag (see --help)");
}

TEST(Arguments, a_flag_that_may_be_repeated_leaves_the_words_behind_its_own_alone) {
  std::vector<std::string> peers, scenes;
  Arguments arguments("tester", "Tests words behind flags");
  arguments.option("--peer", peers, "address of a peer; may be repeated");
  arguments.option("SCENE", scenes, "scenes", Need::required);
  const std::vector<const char*> argv{"tester", "--peer", "x", "--peer", "y", "a.yaml", "b.yaml"};
  ASSERT_TRUE(arguments.parse(static_cast<int>(argv.size()), argv.data()));
  EXPECT_EQ(peers, (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(scenes, (std::vector<std::string>{"a.yaml", "b.yaml"}));
}

TEST(Arguments, help_and_version_end_the_program_well) {
  Command c;
  testing::internal::CaptureStdout();
  EXPECT_FALSE(c.parse({"--help"}));
  EXPECT_FALSE(c.parse({"--version"}));
  const std::string text = testing::internal::GetCapturedStdout();
  EXPECT_NE(text.find("--duration-s"), std::string::npos) << text;
  EXPECT_NE(text.find("tester 0."), std::string::npos) << text;
}

TEST(Arguments, a_command_has_flags_of_its_own) {
  Program p;
  EXPECT_EQ(p.run({"replay", "file"}), 3);
  EXPECT_EQ(p.ran, "replay");
  EXPECT_EQ(p.journal, "file");
  EXPECT_EQ(p.run({"--scene", "a"}), 4);
  EXPECT_EQ(p.ran, "session");
}

TEST(Arguments, unknown_words_are_named_before_missing_ones) {
  Program p;
  EXPECT_EQ(p.refusal({"rplay"}), "unknown command: rplay; did you mean replay?");
  EXPECT_EQ(p.refusal({"--bodies", "a"}), "not expected: --bodies a (see --help)");
  EXPECT_EQ(p.refusal({"replay", "--quick"}), "not expected: --quick (see --help)");
  EXPECT_EQ(p.refusal({"replay"}), "JOURNAL is required (see --help)");
  EXPECT_EQ(p.refusal({}), "--scene is required (see --help)");
  EXPECT_EQ(p.refusal({"--scene", "a", "replay", "file"}), "--scene: the command replay has no use for it");
  EXPECT_EQ(p.ran, "");
}

TEST(Arguments, help_names_commands_and_their_flags) {
  Program p;
  testing::internal::CaptureStdout();
  EXPECT_EQ(p.run({"--help"}), 0);
  EXPECT_EQ(p.run({"replay", "--help"}), 0);
  const std::string text = testing::internal::GetCapturedStdout();
  for (const char* word : {"rebuilds a session", "JOURNAL", "REQUIRED", "--log-level"})
    EXPECT_NE(text.find(word), std::string::npos) << word << text;
  EXPECT_EQ(p.ran, "");
}

TEST(Arguments, exit_codes) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(run_program("tester", [] { return 0; }), 0);
  EXPECT_EQ(run_program("tester", []() -> int { throw InputError("a.yaml:3: step_s: too long"); }), kExitBadInput);
  EXPECT_EQ(run_program("tester", []() -> int { throw std::runtime_error("no socket"); }), 1);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "tester: error: a.yaml:3: step_s: too long\ntester: error: no socket\n");
}

}  // namespace
}  // namespace sectio::core_test
