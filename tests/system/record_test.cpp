// A record of a session: run again, played for viewers, torn, and on a disk that is full.
#include <filesystem>
#include <fstream>

#include "common/dds/qos.h"
#include "common/mcap/mcap_reader.h"
#include "common/messages/codec.h"
#include "common/messages/session.h"
#include "tests/support/flip_file.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

class Record : public test::SessionPrograms {
 protected:
  std::unique_ptr<Process> recorded(Flags more) const {
    more.insert(more.end(), {"--scene", kScene, "--play-traces", "--record", file("a.mcap"), "--export", file("out")});
    return program("sim_server", in_session(more));
  }
  std::unique_ptr<Process> replay() const { return program("sim_server", {"replay", file("a.mcap")}); }
};

TEST_F(Record, is_run_again_and_played_with_the_hashes_of_its_session) {
  const auto server = recorded({"--steps", "2500"});
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  const std::string hash = json("out/report.json")["bodies"][0]["topology_hash"];
  EXPECT_GT(json("out/report.json")["bodies"][0]["revision"], 0);
  const auto again = replay();
  EXPECT_EQ(again->exit_code(), 0) << again->output();
  EXPECT_NE(again->output().find("2500 steps"), std::string::npos) << again->output();
  EXPECT_NE(again->output().find(hash), std::string::npos) << again->output();
  const auto play =
      program("sim_server", in_session({"play", file("a.mcap"), "--wait-for-viewers", "1", "--speed", "4"}));
  const auto screen = viewer("screen", {"--no-pictures"});
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(play->exit_code(), 0) << play->output();
  EXPECT_EQ(json("screen.json")["bodies"][0]["topology_hash"], hash);
}

TEST_F(Record, stays_as_it_was_when_a_program_does_not_come_to_record) {
  ASSERT_EQ(recorded({"--steps", "100"})->exit_code(), 0);
  const auto bytes = std::filesystem::file_size(file("a.mcap"));
  const auto server = recorded({"--steps", "100", "--keys", file("nowhere")});
  EXPECT_EQ(server->exit_code(), 2) << server->output();
  const auto screen =
      program("render_client", in_session({"--no-pictures", "--record", file("a.mcap"), "--duration-s", "1"}));
  EXPECT_NE(screen->exit_code(), 0) << screen->output();
  EXPECT_EQ(std::filesystem::file_size(file("a.mcap")), bytes);
}

TEST_F(Record, whose_beginning_is_damaged_is_not_taken_for_one_without_inputs) {
  ASSERT_EQ(recorded({"--steps", "100"})->exit_code(), 0);
  for (const std::uint64_t at : {10, 40, 70}) {
    test::flip(file("a.mcap"), at, 4);
    const auto again = replay();
    EXPECT_EQ(again->exit_code(), 2) << again->output();
    EXPECT_NE(again->output().find("its beginning is damaged"), std::string::npos) << at << ": " << again->output();
    test::flip(file("a.mcap"), at, 4);
  }
}

TEST_F(Record, of_a_session_that_has_not_ended_is_not_overwritten) {
  auto server = recorded({"--endless"});
  ASSERT_TRUE(server->wait_for(" 2.0")) << server->output();
  server->send(SIGKILL);
  ASSERT_TRUE(server->exit_code());
  const Flags again{"--scene", kScene, "--play-traces", "--steps", "100", "--record", file("a.mcap")};
  const auto bytes = std::filesystem::file_size(file("a.mcap"));
  server = program("sim_server", in_session(again));
  EXPECT_EQ(server->exit_code(), 2) << server->output();
  EXPECT_NE(server->output().find(file("a.mcap") + ": holds a session that has not ended: --resume "),
            std::string::npos)
      << server->output();
  EXPECT_EQ(std::filesystem::file_size(file("a.mcap")), bytes);
  std::filesystem::remove(file("a.mcap"));
  for (int i = 0; i < 2; ++i) {
    server = program("sim_server", in_session(again));
    EXPECT_EQ(server->exit_code(), 0) << "a finished one is: " << server->output();
  }
}

TEST_F(Record, goes_on_from_any_moment_in_another_directory) {
  auto server = recorded({"--steps", "2500"});
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  const std::string hash = hash_of("out");
  for (const Flags& until : {Flags{"--until-s", "1.2"}, Flags{}}) {
    Flags flags{"--resume", file("a.mcap"), "--export", file("again"), "--play-traces", "--steps", "2500"};
    flags.insert(flags.end(), until.begin(), until.end());
    server = program("sim_server", in_session(flags));
    ASSERT_TRUE(server->wait_for(until.empty() ? "goes on after step 2500" : "goes on after step 1200"))
        << server->output();
    EXPECT_EQ(server->exit_code(), 0) << server->output();
    EXPECT_EQ(hash_of("again"), hash);
    EXPECT_EQ(std::filesystem::file_size(file("again/inputs")), std::filesystem::file_size(file("out/inputs")));
  }
  server = program("sim_server", in_session({"--resume", file("a.mcap")}));
  EXPECT_EQ(server->exit_code(), 2) << server->output();
  EXPECT_NE(server->output().find("--resume: a record needs --export"), std::string::npos) << server->output();
  server = program("sim_server", {"replay", file("a.mcap"), "--from-s", "1"});
  EXPECT_EQ(server->exit_code(), 2) << server->output();
  EXPECT_NE(server->output().find("--from-s: a record has no checkpoints"), std::string::npos) << server->output();
}

TEST_F(Record, of_a_server_that_was_killed_is_read_as_far_as_it_is_whole) {
  const auto server = recorded({});
  ASSERT_TRUE(server->wait_for(": step ")) << server->output();
  ASSERT_TRUE(server->wait_for_next(": step ")) << server->output();
  ASSERT_TRUE(server->wait_for_next(": step ")) << server->output();
  server->send(SIGKILL);
  ASSERT_TRUE(server->exit_code());
  const auto again = replay();
  EXPECT_EQ(again->exit_code(), 0) << again->output();
  EXPECT_EQ(again->output().find("\n0 steps"), std::string::npos) << again->output();
  EXPECT_EQ(again->output().find("differs"), std::string::npos) << again->output();
}

TEST_F(Record, that_is_damaged_is_read_as_far_as_it_is_whole_and_that_is_no_success) {
  const auto server = recorded({"--steps", "2500"});
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  const auto size = std::filesystem::file_size(file("a.mcap"));
  {
    std::fstream bytes(file("a.mcap"), std::ios::in | std::ios::out | std::ios::binary);
    for (std::uintmax_t at = size * 2 / 3; at < size * 3 / 4; at += 4096) {  // not only in an index between chunks
      bytes.seekp(static_cast<std::streamoff>(at));
      bytes << "damage";
    }
  }
  const auto again = replay();
  EXPECT_EQ(again->exit_code(), 3) << again->output();
  EXPECT_NE(again->output().find("a.mcap: damaged at byte "), std::string::npos) << again->output();
  EXPECT_EQ(again->output().find("2500 steps"), std::string::npos) << again->output();
  EXPECT_EQ(again->output().find("differs"), std::string::npos) << again->output();
  const auto play = program("sim_server", in_session({"play", file("a.mcap"), "--speed", "10"}));
  EXPECT_EQ(play->exit_code(), 3) << play->output();
  EXPECT_NE(play->output().find("a.mcap: damaged at byte "), std::string::npos) << play->output();
}

TEST_F(Record, whose_first_chunk_has_a_flipped_bit_shows_the_rest_and_says_what_cant_be_simulated_again) {
  const auto server = recorded({"--steps", "12500"});
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  const std::string at = std::to_string([&] {
    McapReader reader(file("a.mcap"));
    const std::uint64_t begin = reader.next_chunk()->place;
    test::flip(file("a.mcap"), begin + 1000, 16);
    return begin;
  }());
  const auto again = replay();
  EXPECT_EQ(again->exit_code(), 3) << again->output();
  EXPECT_NE(again->output().find("a.mcap: damaged at byte " + at +
                                 ": what follows step 0, at 0.00 s, can't be simulated again"),
            std::string::npos)
      << again->output();
  const auto play =
      program("sim_server", in_session({"play", file("a.mcap"), "--wait-for-viewers", "1", "--speed", "10"}));
  const auto screen = viewer("screen", {"--no-pictures"});
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(play->exit_code(), 3) << play->output();
  EXPECT_NE(play->output().find("a.mcap: damaged at byte " + at + ": what is before 10."), std::string::npos)
      << play->output();
  EXPECT_EQ(json("screen.json")["bodies"][0]["topology_hash"], hash_of("out"));
}

TEST_F(Record, of_topology_alone_is_read_as_far_as_it_is_whole) {
  const auto offline = program("sim_server", {"--scene", kScene, "--offline", "--export", file("out")});
  ASSERT_EQ(offline->exit_code(), 0) << offline->output();
  const int revision = json("out/report.json")["bodies"][0]["revision"];
  const std::string journal = file("out/journal");
  std::filesystem::resize_file(journal, std::filesystem::file_size(journal) - 11);
  const auto torn = program("sim_server", {"replay", journal});
  EXPECT_EQ(torn->exit_code(), 3) << torn->output();
  EXPECT_NE(torn->output().find(": truncated record: read as far as it is whole"), std::string::npos) << torn->output();
  EXPECT_NE(torn->output().find("liver: revision " + std::to_string(revision - 1) + ","), std::string::npos)
      << torn->output();
}

TEST_F(Record, ends_with_a_full_disk_and_the_session_goes_on) {
  const std::string script = "ulimit -f 1200; exec \"$@\"";
  Process server("/bin/sh", in_session({"-c", script, "sh", SECTIO_BIN_DIR "/sim_server", "--scene", kScene,
                                        "--play-traces", "--wait-for-viewers", "1", "--record", file("a.mcap")}));
  const auto screen = viewer("screen", {"--no-pictures", "--record", file("heard.mcap")});
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server.exit_code(), 3) << server.output();
  EXPECT_NE(server.output().find("a.mcap: the record ends here: is the disk full?"), std::string::npos)
      << server.output();
  EXPECT_LE(std::filesystem::file_size(file("a.mcap")), 1200u * 512);
  const auto again = replay();
  EXPECT_EQ(again->exit_code(), 0) << again->output();
  EXPECT_NE(again->output().find("a.mcap: it has no end: "), std::string::npos) << again->output();
  McapReader heard(file("heard.mcap"));
  bool told = false;
  while (const auto message = heard.next(qos_of<SessionEvent>().name)) {
    const auto event = decode<SessionEvent>(message->bytes);
    told = told || (event && event->text.find("a.mcap: the record ends here") != std::string::npos);
  }
  EXPECT_TRUE(told);
}

}  // namespace
}  // namespace sectio
