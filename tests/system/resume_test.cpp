// A session goes on from its journal of inputs after its server was killed, whatever happened to the journal's end.
#include <algorithm>
#include <filesystem>
#include <sstream>

#include "common/core/error.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

class Resume : public test::SessionPrograms {
 protected:
  std::unique_ptr<Process> begin(Flags more) const {
    more.insert(more.end(), {"--scene", kScene, "--export", file("out")});
    return program("sim_server", in_session(more));
  }
  std::unique_ptr<Process> resume(Flags more) const {
    more.insert(more.end(), {"--resume", file("out")});
    return program("sim_server", in_session(more));
  }
  std::unique_ptr<Process> replay() const { return program("sim_server", {"replay", file("out/inputs")}); }

  std::string hash() const { return hash_of("out"); }

  static std::uint64_t number_after(const std::string& text, const std::string& words) {
    const std::size_t at = text.rfind(words);
    return at == std::string::npos ? 0 : std::stoull(text.substr(at + words.size()));
  }
  static void kill(Process& process) {
    process.send(SIGKILL);
    EXPECT_TRUE(process.exit_code());
  }
};

TEST_F(Resume, a_session_whose_server_is_killed_again_and_again_ends_as_if_nothing_had_happened) {
  auto server = begin({"--play-traces", "--wait-for-viewers", "1"});
  const auto screen = viewer("screen", {"--no-pictures"});
  for (int deaths = 0; deaths < 3; ++deaths) {
    ASSERT_TRUE(server->wait_for("the session "));
    ASSERT_TRUE(server->wait_for_next("step ")) << server->output();
    ASSERT_TRUE(server->wait_for_next(" cuts")) << server->output();
    kill(*server);
    const std::uint64_t told = number_after(server->output(), ": step ");
    server = resume({"--play-traces"});
    ASSERT_TRUE(server->wait_for("the session goes on after step ")) << server->output();
    EXPECT_GE(number_after(server->output(), "goes on after step "), told);
  }
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(hash(), undisturbed_hash());
  const auto again = replay();
  EXPECT_EQ(again->exit_code(), 0) << again->output();
  EXPECT_NE(again->output().find(hash()), std::string::npos) << again->output();
}

TEST_F(Resume, a_hand_and_a_viewer_go_on_with_the_server_that_follows) {
  auto server = begin({"--endless"});
  const auto screen = viewer("screen", {"--no-pictures"});
  const auto hand = bridge();
  ASSERT_TRUE(hand->wait_for("2.0 s, force")) << hand->output();
  kill(*server);
  server = resume({"--endless"});
  ASSERT_TRUE(server->wait_for("the session goes on after step ")) << server->output();
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  server->send(SIGINT);
  EXPECT_TRUE(server->exit_code()) << server->output();
  expect_equal_at_the_end(*screen);
  EXPECT_GT(json("out/report.json")["bodies"][0]["revision"], 0);
  const auto again = replay();
  EXPECT_EQ(again->exit_code(), 0) << again->output();
  EXPECT_NE(again->output().find(hash()), std::string::npos) << again->output();
}

TEST_F(Resume, an_instrument_whose_hand_died_with_the_server_is_withdrawn) {
  auto server = begin({"--endless"});
  const auto hand = bridge();
  ASSERT_TRUE(hand->wait_for("2.0 s, force")) << hand->output();
  hand->send(SIGKILL);
  kill(*server);
  EXPECT_TRUE(hand->exit_code());
  server = resume({"--endless"});
  ASSERT_TRUE(server->wait_for("the session goes on\n")) << server->output();
  for (int seconds = 0; seconds < 3; ++seconds) ASSERT_TRUE(server->wait_for_next("step ")) << server->output();
  server->send(SIGINT);
  EXPECT_TRUE(server->exit_code()) << server->output();
  EXPECT_EQ(json("out/report.json")["run"]["events"].value("instrument withdrawn", 0), 1);
}

TEST_F(Resume, a_torn_end_is_left_out_with_a_word_and_the_session_goes_on_before_it) {
  auto server = begin({"--play-traces", "--steps", "800"});
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  const std::string whole = hash(), inputs = file("out/inputs");
  std::filesystem::resize_file(inputs, std::filesystem::file_size(inputs) - 7);
  const auto torn = replay();
  EXPECT_EQ(torn->exit_code(), 3) << torn->output();
  EXPECT_NE(torn->output().find("799 steps"), std::string::npos) << torn->output();
  EXPECT_NE(torn->output().find("out/inputs: damaged at byte "), std::string::npos) << torn->output();
  const auto play = program("sim_server", in_session({"play", inputs, "--speed", "100"}));
  EXPECT_EQ(play->exit_code(), 3) << play->output();
  server = resume({"--play-traces", "--steps", "800"});
  EXPECT_TRUE(server->wait_for("damaged at byte ")) << server->output();
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(hash(), whole);
  EXPECT_FALSE(std::filesystem::exists(inputs + ".damaged"));
}

TEST_F(Resume, a_journal_that_is_damaged_before_its_last_checkpoint_is_not_ok) {
  auto server = begin({"--play-traces", "--steps", "1800"});
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  const std::string inputs = file("out/inputs");
  std::fstream bytes(inputs, std::ios::binary | std::ios::in | std::ios::out);
  const auto at = static_cast<std::streamoff>(std::filesystem::file_size(inputs) / 8);
  bytes.seekg(at);
  const auto flipped = static_cast<char>(bytes.get() ^ 4);
  bytes.seekp(at);
  bytes.put(flipped);
  bytes.close();
  server = resume({"--play-traces", "--steps", "1900"});
  EXPECT_EQ(server->exit_code(), 3) << server->output();
  EXPECT_NE(server->output().find("the session goes on from its checkpoint of step "), std::string::npos)
      << server->output();
  EXPECT_EQ(json("out/report.json")["ok"], false);
}

TEST_F(Resume, a_journal_that_is_damaged_in_the_middle_is_cut_there_keeps_what_is_cut_off_and_the_session_is_not_ok) {
  const auto bytes_of = [](const std::string& path) {
    std::ifstream bytes(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(bytes), {});
  };
  auto server = begin({"--play-traces", "--steps", "800"});
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  const std::string whole = hash(), inputs = file("out/inputs");
  for (const std::string& kept : {inputs + ".damaged", inputs + ".damaged.2"}) {
    std::string bytes = bytes_of(inputs);
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
    std::ofstream(inputs, std::ios::binary) << bytes;
    server = resume({"--play-traces", "--steps", "800"});
    EXPECT_EQ(server->exit_code(), 3) << server->output();
    const std::string at = inputs + ": damaged at byte ";
    const std::size_t begin = server->output().find("warning: " + at);
    ASSERT_NE(begin, std::string::npos) << server->output();
    EXPECT_NE(server->output().find("bytes are not read, and kept in " + kept + "\n"), std::string::npos)
        << server->output();
    EXPECT_EQ(bytes_of(kept), bytes.substr(number_after(server->output().substr(0, begin + 200), at)));
    EXPECT_EQ(json("out/report.json")["ok"], false);
    EXPECT_EQ(std::string(json("out/report.json")["reasons"][0]).find(at), 0u);
    EXPECT_EQ(hash(), whole) << "traces have no hands that are gone";
  }
}

TEST_F(Resume, a_journal_that_ends_before_the_last_checkpoint_goes_on_from_the_one_before) {
  auto server = begin({"--play-traces", "--steps", "2400"});
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  const std::string whole = hash(), inputs = file("out/inputs");
  std::filesystem::resize_file(inputs, std::filesystem::file_size(inputs) * 3 / 5);
  server = resume({"--play-traces", "--steps", "2400"});
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_NE(server->output().find("is passed over: the journal of inputs ends before it"), std::string::npos)
      << server->output();
  EXPECT_EQ(hash(), whole);
}

TEST_F(Resume, a_full_disk_ends_the_journals_and_not_the_session) {
  auto whole = begin({"--play-traces"});
  ASSERT_EQ(whole->exit_code(), 0) << whole->output();
  const std::string expected = hash();
  // Files may grow to less than each needs; a journal of topology begins with the bodies.
  const auto most = std::min(std::filesystem::file_size(file("out/inputs")) / 2,
                             std::filesystem::file_size(file("out/journal")) * 7 / 8);
  const auto blocks = most / 512;
  const std::string script = "ulimit -f " + std::to_string(blocks) + "; exec \"$@\"";
  Flags flags = in_session({"-c", script, "sh", SECTIO_BIN_DIR "/sim_server", "--scene", kScene, "--export",
                            file("full"), "--play-traces", "--wait-for-viewers", "1"});
  Process server("/bin/sh", flags);
  const auto screen = viewer("screen", {"--no-pictures"});
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server.exit_code(), 3) << server.output();
  EXPECT_NE(server.output().find("inputs are kept no longer"), std::string::npos) << server.output();
  EXPECT_EQ(json("full/report.json")["bodies"][0]["topology_hash"], expected);
  const auto again = program("sim_server", {"replay", file("full/inputs")});
  EXPECT_EQ(again->exit_code(), 0) << again->output();
}

TEST_F(Resume, a_session_is_played_again_for_viewers_and_branches_off_at_an_earlier_moment) {
  auto server = begin({"--play-traces", "--steps", "2500"});
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  const std::string recorded = hash();
  const auto size = std::filesystem::file_size(file("out/inputs"));
  const auto play =
      program("sim_server",
              in_session({"play", file("out/inputs"), "--wait-for-viewers", "1", "--speed", "3", "--from-s", "0.5"}));
  const auto screen = viewer("screen", {"--no-pictures"});
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(play->exit_code(), 0) << play->output();
  EXPECT_EQ(json("screen.json")["bodies"][0]["topology_hash"], recorded);

  const auto beyond = program("sim_server", {"replay", file("out/inputs"), "--from-s", "99"});
  EXPECT_EQ(beyond->exit_code(), 2) << beyond->output();
  EXPECT_NE(beyond->output().find("the inputs end at step 2500, before that moment"), std::string::npos)
      << beyond->output();

  server = program("sim_server", in_session({"--resume", file("out"), "--until-s", "1.2", "--export", file("again"),
                                             "--play-traces", "--steps", "2500"}));
  ASSERT_TRUE(server->wait_for("the session goes on after step 1200")) << server->output();
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(json("again/report.json")["bodies"][0]["topology_hash"], recorded);
  EXPECT_EQ(std::filesystem::file_size(file("again/inputs")), size);
  EXPECT_EQ(std::filesystem::file_size(file("out/inputs")), size);
}

TEST_F(Resume, the_same_command_after_a_crash_does_not_overwrite_the_session) {
  const auto first = program("sim_server", in_session({"--scene", kScene, "--export", file("out"), "--play-traces"}));
  ASSERT_TRUE(has_simulated(*first, 1)) << first->output();
  kill(*first);
  const auto bytes = std::filesystem::file_size(file("out/inputs"));
  const auto again = program("sim_server", in_session({"--scene", kScene, "--export", file("out"), "--play-traces"}));
  EXPECT_EQ(again->exit_code(), kExitBadInput) << again->output();
  EXPECT_NE(again->output().find("--resume " + file("out") + " goes on with it"), std::string::npos) << again->output();
  EXPECT_EQ(std::filesystem::file_size(file("out/inputs")), bytes);
}

TEST_F(Resume, whatever_a_server_is_told_to_be_it_does_not_overwrite_a_session_that_has_not_ended) {
  const auto server = begin({"--play-traces", "--endless"});
  ASSERT_TRUE(server->wait_for(" cuts")) << server->output();
  kill(*server);
  const auto bytes = std::filesystem::file_size(file("out/inputs"));
  const std::string until = "--until-s: needs another --export";
  for (const auto& [flags, why] :
       {std::pair(Flags{"--offline", "--scene", kScene, "--export", file("out")}, std::string("has not ended")),
        std::pair(Flags{"--standby", "--scene", kScene, "--export", file("out")}, std::string("has not ended")),
        std::pair(Flags{"--resume", file("out"), "--until-s", "0.1", "--export", file("out")}, until),
        std::pair(Flags{"--resume", file("out"), "--until-s", "0.1", "--export", file("out") + "/."}, until)}) {
    const auto other = program("sim_server", in_session(flags));
    EXPECT_EQ(other->exit_code(), 2) << other->output();
    EXPECT_NE(other->output().find(why), std::string::npos) << other->output();
    EXPECT_EQ(std::filesystem::file_size(file("out/inputs")), bytes);
  }
}

TEST_F(Resume, a_session_that_another_server_holds_is_not_resumed) {
  auto server = begin({"--play-traces", "--endless"});
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  std::filesystem::copy(file("out"), file("copy"), std::filesystem::copy_options::recursive);
  const auto second = program("sim_server", in_session({"--resume", file("copy"), "--endless"}));
  EXPECT_EQ(second->exit_code(), 1) << second->output();  // a unit tries again, as its standby
  EXPECT_NE(second->output().find("another server holds it: nothing to resume"), std::string::npos) << second->output();
  ASSERT_TRUE(server->wait_for_next("step ")) << server->output();
}

TEST_F(Resume, a_report_says_that_the_session_has_ended_and_goes_when_it_goes_on) {
  auto server = begin({"--play-traces", "--steps", "300"});
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  std::filesystem::copy(file("out"), file("copy"), std::filesystem::copy_options::recursive);
  server = resume({"--play-traces", "--endless"});
  ASSERT_TRUE(server->wait_for("the session goes on\n")) << server->output();
  ASSERT_TRUE(server->wait_for("step ")) << server->output();
  const auto second = program("sim_server", in_session({"--resume", file("copy"), "--endless"}));
  EXPECT_EQ(second->exit_code(), 1) << second->output();
  EXPECT_TRUE(std::filesystem::exists(file("copy/report.json")));
  EXPECT_FALSE(std::filesystem::exists(file("out/report.json")));
  kill(*server);
  EXPECT_FALSE(std::filesystem::exists(file("out/report.json")));
}

// Each kind of body, of contact and of cut: what decides a step's bits must be in its inputs or in the scene.
// It may wake up, and would write on.
TEST_F(Resume, a_journal_that_a_halted_server_holds_is_left_alone) {
  auto server = begin({"--play-traces", "--endless"});
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  server->send(SIGSTOP);
  const auto size = std::filesystem::file_size(file("out/inputs"));
  const auto topology = std::filesystem::file_size(file("out/journal"));
  for (const Flags& flags : {Flags{"--resume", file("out")}, Flags{"--scene", kScene, "--export", file("out")}}) {
    const auto second = program("sim_server", in_session(flags));
    EXPECT_EQ(second->exit_code(), 2) << second->output();
    EXPECT_NE(second->output().find("out: another run writes there"), std::string::npos) << second->output();
  }
  EXPECT_EQ(std::filesystem::file_size(file("out/inputs")), size);
  EXPECT_EQ(std::filesystem::file_size(file("out/journal")), topology);
  server->send(SIGCONT);
  ASSERT_TRUE(server->wait_for_next("step ")) << server->output();
}

TEST_F(Resume, every_kind_of_scene_is_the_same_when_its_inputs_are_run_again) {
  for (const std::string scene : {"bar_lattice_cut", "bar_two_sequences", "scissors_edge", "incision_templates",
                                  "two_organs", "probe_liver_templates"}) {
    const auto offline = program("sim_server", {"--scene", SECTIO_SOURCE_DIR "/deploy/scenes/" + scene + ".yaml",
                                                "--offline", "--export", file(scene)});
    ASSERT_EQ(offline->exit_code(), 0) << scene << offline->output();
    const auto again = program("sim_server", {"replay", file(scene + "/inputs")});
    EXPECT_EQ(again->exit_code(), 0) << scene << again->output();
    for (const auto& body : json(scene + "/report.json")["bodies"])
      EXPECT_NE(again->output().find(body["topology_hash"].get<std::string>()), std::string::npos) << scene;
  }
}

TEST_F(Resume, a_scene_that_has_changed_meanwhile_is_refused_by_the_step_at_which_it_differs) {
  write("scene.yaml", scene_with_young("5400"));
  const auto server =
      program("sim_server",
              in_session({"--scene", file("scene.yaml"), "--export", file("out"), "--play-traces", "--steps", "200"}));
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  write("scene.yaml", scene_with_young("9400"));
  const auto resumed = resume({"--play-traces"});
  EXPECT_EQ(resumed->exit_code(), 2) << resumed->output();
  EXPECT_NE(resumed->output().find("the simulation is not the one that wrote it: step 64: the positions"),
            std::string::npos)
      << resumed->output();
  const auto again = replay();
  EXPECT_EQ(again->exit_code(), 3) << again->output();
  EXPECT_NE(again->output().find("differs from the recorded session at step 64"), std::string::npos) << again->output();
}

}  // namespace
}  // namespace sectio
