// A program on Cyclone DDS in a session of the real server: it holds the bodies, bit for bit.
#include "common/messages/protocol.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Process;

class OtherVendor : public test::SessionPrograms {
 protected:
  std::unique_ptr<Process> cyclone_viewer() const {
    return program("cyclone_viewer",
                   {std::to_string(network.domain), network.session, std::to_string(kProtocolVersion)});
  }
  std::unique_ptr<Process> cyclone_writer() const {
    return program("cyclone_writer",
                   {std::to_string(network.domain), network.session, std::to_string(kProtocolVersion)});
  }
  static void expect_equal_to(const std::string& hash, Process& viewer) {
    EXPECT_EQ(viewer.exit_code(), 0) << viewer.output();
    for (const std::string& text : {std::string("body 0: liver"), "hash " + hash, std::string("equals server: yes")})
      EXPECT_NE(viewer.output().find(text), std::string::npos) << viewer.output() << "does not say " << text;
  }
  // "heard 12 deltas, 3 states, ...": the number before the word.
  static int heard(const std::string& word, const Process& viewer) {
    const std::string& said = viewer.output();
    const std::size_t end = said.find(" " + word, said.rfind("heard "));
    return end == std::string::npos ? -1 : std::stoi(said.substr(said.rfind(' ', end - 1)));
  }
};

TEST_F(OtherVendor, holds_the_bodies_of_a_session_from_its_beginning_and_from_its_middle) {
  const auto server =
      program("sim_server",
              in_session({"--scene", kScene, "--play-traces", "--wait-for-viewers", "1", "--export", file("out")}));
  const auto early = cyclone_viewer();
  const auto killed = cyclone_viewer();
  ASSERT_TRUE(killed->wait_for("body 0")) << killed->output();
  killed->send(SIGKILL);
  ASSERT_TRUE(early->wait_for("event of kind 2")) << early->output();   // it cuts
  ASSERT_TRUE(early->wait_for("body 0: revision")) << early->output();  // and the body has changed
  const auto late = cyclone_viewer();
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(server->output().find("went silent"), std::string::npos) << server->output();  // it waits for none of them
  const nlohmann::json body = json("out/report.json")["bodies"][0];
  ASSERT_GT(body["revision"], 100);
  expect_equal_to(body["topology_hash"], *early);
  expect_equal_to(body["topology_hash"], *late);

  const std::string announcement =
      "sectio protocol=" + std::to_string(kProtocolVersion) + " session=" + network.session;
  EXPECT_NE(early->output().find(announcement), std::string::npos) << early->output();
  EXPECT_GT(heard("deltas", *early), 50);
  EXPECT_LE(heard("deltas", *early), body["revision"]);  // a state brings those before it as one
  EXPECT_GT(heard("deltas", *late), 0);
  EXPECT_LT(heard("deltas", *late), heard("deltas", *early));
  for (const Process* viewer : {early.get(), late.get()})
    for (const char* kind : {"states", "pieces", "events", "status"}) EXPECT_GT(heard(kind, *viewer), 0) << kind;
}

constexpr const char* kHeardTool = "a device bridge moves tool 9; the scene has 1 tool";

TEST_F(OtherVendor, moves_an_instrument_and_leads_in_an_open_session) {
  const auto server = program("sim_server", in_session({"--scene", kScene, "--endless"}));
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  const auto writer = cyclone_writer();
  EXPECT_TRUE(server->wait_for(kHeardTool)) << server->output();
  EXPECT_TRUE(server->wait_for("paused")) << server->output();
  EXPECT_EQ(writer->exit_code(), 0) << writer->output();
  EXPECT_NE(writer->output().find("readers of tool_packets: 1, of session_orders: 1"), std::string::npos)
      << writer->output();
}

// It knows the program is there, and writes; nothing of that is heard.
TEST_F(OtherVendor, neither_moves_an_instrument_nor_leads_in_a_session_with_keys) {
  Process keys(SECTIO_SOURCE_DIR "/deploy/keys", {"make", file("keys"), "server", "instructor"});
  ASSERT_EQ(keys.exit_code(), 0) << keys.output();
  const auto server =
      program("sim_server",
              in_session({"--scene", kScene, "--endless", "--export", file("out"), "--keys", file("keys/server")}));
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  const auto writer = cyclone_writer();
  EXPECT_EQ(writer->exit_code(), 0) << writer->output();
  EXPECT_NE(writer->output().find("readers of tool_packets: 0, of session_orders: 0"), std::string::npos)
      << writer->output();
  const auto status = program(
      "sim_server", in_session({"status", "--every-field", "--patience-s", "60", "--keys", file("keys/instructor")}));
  EXPECT_EQ(status->exit_code(), 0) << status->output();
  EXPECT_NE(status->output().find("samples_refused_count: 0,"), std::string::npos) << status->output();
  server->send(SIGINT);
  EXPECT_TRUE(server->exit_code()) << server->output();
  EXPECT_EQ(server->output().find("moves tool"), std::string::npos) << server->output();
  EXPECT_EQ(server->output().find("paused"), std::string::npos) << server->output();
  EXPECT_EQ(json("out/report.json")["session_cost"]["orders_refused"], 0);
}

}  // namespace
}  // namespace sectio
