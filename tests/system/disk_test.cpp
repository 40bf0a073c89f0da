// A disk that is full: no session ends, nothing half written stays, and whoever looks at the exit code knows.
#include <algorithm>
#include <filesystem>
#include <set>

#include "common/core/error.h"
#include "common/dds/qos.h"
#include "common/mcap/mcap_reader.h"
#include "common/messages/codec.h"
#include "common/messages/session.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;
using test::Flags;
using test::Process;

class Disk : public test::SessionPrograms {
 protected:
  // Files can grow to so many bytes.
  static std::unique_ptr<Process> limited(std::uintmax_t bytes, const std::string& name, const Flags& flags) {
    const std::string script = "ulimit -f " + std::to_string(bytes / 512) + "; exec \"$@\"";
    return started(script, name, flags);
  }
  // file("disk") has so many kilobytes; its files are in file("left") afterwards.
  std::unique_ptr<Process> on_small_disk(int kilobytes, const std::string& name, const Flags& flags) const {
    fs::create_directories(file("disk"));
    const std::string script = "mount -t tmpfs -o size=" + std::to_string(kilobytes) + "k none '" + file("disk") +
                               "' && { \"$@\"; code=$?; cp -r '" + file("disk") + "' '" + file("left") +
                               "'; exit $code; }";
    return started("exec unshare -rm /bin/sh -c \"$0\" sh \"$@\"", name, flags, script);
  }
  std::set<std::string> left() const {
    std::set<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(file("left")))
      if (entry.is_regular_file()) names.insert(fs::relative(entry.path(), file("left")).string());
    return names;
  }
  void expect_whole(const std::string& name) const {
    const auto again = program("sim_server", {"replay", file("left/" + name)});
    EXPECT_EQ(again->exit_code(), 0) << again->output();
    EXPECT_EQ(again->output().find("damaged"), std::string::npos) << again->output();
  }
  static std::size_t count(const std::string& text, const std::string& words) {
    std::size_t times = 0;
    for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++times;
    return times;
  }

 private:
  static std::unique_ptr<Process> started(const std::string& script, const std::string& name, const Flags& flags,
                                          const std::string& zeroth = "sh") {
    Flags all{"-c", script, zeroth, std::string(SECTIO_BIN_DIR "/") + name};
    all.insert(all.end(), flags.begin(), flags.end());
    return std::make_unique<Process>("/bin/sh", all);
  }
};

TEST_F(Disk, that_takes_no_surface_leaves_none_and_the_report_says_so) {
  const Flags flags{"--scene", kScene, "--offline", "--steps", "100", "--export", file("out")};
  ASSERT_EQ(program("sim_server", flags)->exit_code(), 0);
  const auto size = fs::file_size(file("out/liver.obj"));
  fs::remove(file("out/liver.obj"));
  const auto run = limited(size - 1024, "sim_server", flags);
  EXPECT_EQ(run->exit_code(), 3) << run->output();
  const std::string reason = file("out/liver.obj") + ": can't be written: File too large";
  EXPECT_EQ(count(run->output(), "warning: " + reason), 1u) << run->output();
  EXPECT_EQ(json("out/report.json")["ok"], false);
  EXPECT_EQ(json("out/report.json")["reasons"], nlohmann::json{reason});
  EXPECT_FALSE(fs::exists(file("out/liver.obj")));
  EXPECT_FALSE(fs::exists(file("out/liver.obj.part")));
}

TEST_F(Disk, that_is_full_holds_no_half_of_a_result_and_no_report_of_an_earlier_run) {
  const auto run =
      on_small_disk(600, "sim_server", {"--scene", kScene, "--offline", "--export", file("disk/out mit Übung")});
  EXPECT_EQ(run->exit_code(), 3) << run->output();
  for (const char* name : {"liver.obj", "report.json"})
    EXPECT_EQ(
        count(run->output(), file("disk/out mit Übung/") + name + ": can't be written: No space left on device\n"), 1u)
        << run->output();
  const std::set<std::string> names = left();
  EXPECT_FALSE(names.contains("out mit Übung/liver.obj"));
  EXPECT_FALSE(names.contains("out mit Übung/report.json"));
  EXPECT_TRUE(std::ranges::none_of(names, [](const std::string& name) { return name.ends_with(".part"); }));
  expect_whole("out mit Übung/journal");
  expect_whole("out mit Übung/inputs");
}

TEST_F(Disk, that_is_full_ends_neither_a_session_nor_its_viewers_and_all_are_told) {
  const auto server = on_small_disk(1500, "sim_server",
                                    in_session({"--scene", kScene, "--play-traces", "--wait-for-viewers", "1",
                                                "--export", file("disk/out"), "--record", file("disk/a.mcap")}));
  const auto screen = viewer("screen", {"--no-pictures", "--record", file("heard.mcap")});
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server->exit_code(), 3) << server->output();
  EXPECT_EQ(count(server->output(), "a.mcap: the record ends here"), 3u)
      << server->output();  // and in the report, twice
  for (const char* name : {"out/inputs", "out/journal", "a.mcap"}) expect_whole(name);
  std::set<std::string> told;
  McapReader heard(file("heard.mcap"));
  while (const auto message = heard.next(qos_of<SessionEvent>().name))
    if (const auto event = decode<SessionEvent>(message->bytes);
        event && event->text.find("disk/") != std::string::npos)
      told.insert(event->text.substr(event->text.find("disk/"), 10));
  for (const char* name : {"disk/out/i", "disk/out/j", "disk/out/c"}) EXPECT_TRUE(told.contains(name)) << name;
}

TEST_F(Disk, that_is_full_lets_no_session_begin_anew_and_ends_none) {
  const auto server = on_small_disk(
      900, "sim_server",
      in_session({"--scene", kScene, "--play-traces", "--wait-for-viewers", "1", "--export", file("disk/out")}));
  const auto screen = viewer("screen", {"--no-pictures"});
  ASSERT_TRUE(server->wait_for("inputs are kept no longer")) << server->output();
  const auto anew = program("sim_server", in_session({"anew", "--patience-s", "60"}));
  EXPECT_EQ(anew->exit_code(), kExitBadInput) << anew->output();
  EXPECT_NE(
      anew->output().find("anew: refused by the server of liver: it stays where it is: " + file("disk/out/try_2")),
      std::string::npos)
      << anew->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server->exit_code(), 3) << server->output();
  for (const std::string& name : left()) EXPECT_EQ(name.find("try_2"), std::string::npos) << name;
}

TEST_F(Disk, that_takes_no_pictures_leaves_the_viewer_in_its_session) {
  const auto server =
      program("sim_server", in_session({"--scene", kScene, "--play-traces", "--wait-for-viewers", "1"}));
  const auto screen =
      on_small_disk(300, "render_client",
                    in_session({"--name", "screen", "--size", "320x200", "--fps", "5", "--out", file("disk/frames"),
                                "--contact-sheet", file("disk/sheet.png"), "--record", file("disk/heard.mcap"),
                                "--report", file("disk/screen.json")}));
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(screen->exit_code(), 1) << screen->output();
  EXPECT_NE(screen->output().find("equals server: yes"), std::string::npos) << screen->output();
  for (const char* name : {"frames/frame_0", "sheet.png", "heard.mcap: the record ends here"})
    EXPECT_EQ(count(screen->output(), file("disk/") + name), 1u) << screen->output();
  const std::set<std::string> names = left();
  EXPECT_TRUE(std::ranges::none_of(names, [](const std::string& name) { return name.ends_with(".part"); }));
}

TEST_F(Disk, that_takes_no_more_of_a_log_leaves_the_hand_in_its_session) {
  const auto server = program("sim_server", in_session({"--scene", kScene, "--endless"}));
  const auto hand =
      limited(4096, "device_bridge",
              in_session({"--trace", kTrace, "--wait-for-server", "--duration-s", "0.5", "--log", file("force.csv")}));
  EXPECT_EQ(hand->exit_code(), 1) << hand->output();
  EXPECT_EQ(count(hand->output(), "warning: --log: " + file("force.csv") + ": the disk takes no more"), 1u)
      << hand->output();
  server->send(SIGINT);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
}

TEST_F(Disk, that_takes_no_output_is_no_success) {
  const auto plan = std::make_unique<Process>(
      "/bin/sh", Flags{"-c", "exec \"$0\" schema >/dev/full", std::string(SECTIO_BIN_DIR "/sim_server")});
  EXPECT_EQ(plan->exit_code(), 1) << plan->output();
  EXPECT_NE(plan->output().find("standard output: can't be written: No space left on device"), std::string::npos)
      << plan->output();
}

}  // namespace
}  // namespace sectio
