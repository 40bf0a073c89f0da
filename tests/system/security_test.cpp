// Keys (docs/security.md): a session of programs that have them is whole, and nobody else takes part.
#include <algorithm>
#include <filesystem>

#include "common/core/error.h"
#include "tests/support/gateway_programs.h"
#include "tests/support/web_peer.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

class Security : public test::GatewayPrograms {
 protected:
  std::string run_keys(const Flags& flags) const {
    Process keys(SECTIO_SOURCE_DIR "/deploy/keys", flags);
    EXPECT_EQ(keys.exit_code(), 0) << keys.output();
    return keys.output();
  }
  // Keys that have expired since: `date` says that it is another day.
  void make_keys_in_february_2024(Flags flags) const {
    std::filesystem::create_directory(file("then"));
    write("then/date",
          "#!/bin/sh\n"
          "case \"$*\" in *-d*) exec /usr/bin/date \"$@\" ;; esac\n"
          "exec /usr/bin/date -d 2024-02-01 \"$@\"\n");
    std::filesystem::permissions(file("then/date"), std::filesystem::perms::owner_all);
    flags.insert(flags.begin(),
                 {"PATH=" + file("then") + ":/usr/bin:/bin", SECTIO_SOURCE_DIR "/deploy/keys", "make", file("keys")});
    Process keys("/usr/bin/env", flags);
    EXPECT_EQ(keys.exit_code(), 0) << keys.output();
  }
  void SetUp() override {
    GatewayPrograms::SetUp();
    run_keys({"make", file("keys"), "server", "standby", "instructor", "observer", "trainee-0", "trainee-1"});
  }
  Flags with_keys(const std::string& identity, Flags flags, const std::string& group = "keys") const {
    flags.insert(flags.end(), {"--keys", file(group + "/" + identity)});
    return in_session(flags);
  }
  std::unique_ptr<Process> endless_server() const {
    auto server = program("sim_server", with_keys("server", {"--scene", kScene, "--endless"}));
    EXPECT_TRUE(server->wait_for("the session begins")) << server->output();
    return server;
  }
  static void expect_refused(Process& process, const std::string& why) {
    EXPECT_EQ(process.exit_code(), kExitBadInput) << process.output();
    EXPECT_NE(process.output().find(why), std::string::npos) << process.output();
  }
};

TEST_F(Security, keys_that_have_expired_already_are_not_made) {
  for (const char* day : {"yesterday", "2020-02-29", "", "someday"}) {
    Process keys(SECTIO_SOURCE_DIR "/deploy/keys", {"make", file("keys"), "--until", day, "observer-late"});
    expect_refused(keys, "keys: --until: ");
    EXPECT_EQ(std::ranges::count(keys.output(), '\n'), 1) << keys.output();
    EXPECT_FALSE(std::filesystem::exists(file("keys/observer-late"))) << day;
  }
  run_keys({"make", file("keys"), "--until", "today", "observer-late"});
  EXPECT_NE(run_keys({"list", file("keys")}).find("observer-late "), std::string::npos);
}

TEST_F(Security, a_session_with_keys_is_whole) {
  const auto server =
      program("sim_server", with_keys("server", {"--scene", kScene, "--wait-for-tools", "--wait-for-viewers", "2"}));
  const auto hand = program("device_bridge", with_keys("trainee-0", {"--trace", kTrace, "--wait-for-server"}));
  const auto one = program("render_client", with_keys("observer", {"--no-pictures", "--name", "one"}));
  const auto two = program("render_client", with_keys("instructor", {"--no-pictures", "--name", "two"}));
  expect_equal_at_the_end(*one);
  expect_equal_at_the_end(*two);
  EXPECT_EQ(hand->exit_code(), 0) << hand->output();
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_EQ(server->output().find("cuts 0"), std::string::npos) << server->output();
}

TEST_F(Security, a_standby_with_keys_of_its_own_goes_on) {
  const auto first =
      program("sim_server", with_keys("server", {"--scene", kScene, "--play-traces", "--wait-for-viewers", "1"}));
  const auto second = program("sim_server", with_keys("standby", {"--scene", kScene, "--play-traces", "--standby"}));
  ASSERT_TRUE(second->wait_for("it hears the server")) << second->output();
  const auto screen = program("render_client", with_keys("observer", {"--no-pictures"}));
  ASSERT_TRUE(second->wait_for("it has caught up with the server")) << second->output();
  first->send(SIGKILL);
  EXPECT_TRUE(second->wait_for("this one goes on after step ")) << second->output();
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(second->exit_code(), 0) << second->output();
}

TEST_F(Security, a_program_without_keys_or_with_those_of_others_meets_nobody_and_both_sides_say_so) {
  run_keys({"make", file("others"), "observer"});
  const auto server = endless_server();
  const auto open = program("render_client", in_session({"--no-pictures", "--duration-s", "3"}));
  EXPECT_EQ(open->exit_code(), 1) << open->output();
  EXPECT_NE(open->output().find("sim_server has keys, this program none (--keys)"), std::string::npos)
      << open->output();
  EXPECT_TRUE(server->wait_for(" has no keys, this program has")) << server->output();
  const auto other = program("render_client", with_keys("observer", {"--no-pictures", "--duration-s", "3"}, "others"));
  EXPECT_EQ(other->exit_code(), 1) << other->output();
  EXPECT_NE(other->output().find("sim_server has keys of another authority"), std::string::npos) << other->output();
  EXPECT_TRUE(server->wait_for(" has keys of another authority")) << server->output();
}

TEST_F(Security, an_observer_moves_nothing_and_orders_nothing) {
  const auto server = endless_server();
  expect_refused(*program("sim_server", with_keys("observer", {"pause"})), "observer may not write session_orders");
  expect_refused(*program("sim_server", with_keys("trainee-0", {"pause"})), "trainee-0 may not write session_orders");
  expect_refused(*program("device_bridge", with_keys("observer", {"--trace", kTrace})), "observer may not ");
  const auto order = program("sim_server", with_keys("instructor", {"pause"}));
  EXPECT_EQ(order->exit_code(), 0) << order->output();
  EXPECT_TRUE(server->wait_for("paused")) << server->output();
}

TEST_F(Security, a_trainee_moves_no_instrument_but_the_own_one) {
  const auto server = endless_server();
  const auto hand = program("device_bridge", with_keys("trainee-1", {"--trace", kTrace, "--wait-for-server"}));
  EXPECT_TRUE(server->wait_for("trainee-1 moves tool 0: it is not heard, because its keys are for tool 1"))
      << server->output();
  EXPECT_TRUE(hand->wait_for("warning: no pose was answered: ")) << hand->output();
  hand->send(SIGTERM);
  EXPECT_EQ(hand->exit_code(), 1) << hand->output();
  EXPECT_NE(hand->output().find("--tool-id 0: the keys are those of trainee-1: no server will hear it"),
            std::string::npos)
      << hand->output();
  EXPECT_EQ(hand->output().find("age of model: 1 ms"), std::string::npos) << hand->output();
}

TEST_F(Security, expired_and_revoked_keys_are_refused_with_one_line) {
  make_keys_in_february_2024({"--until", "2024-02-03", "observer-old"});
  run_keys({"make", file("keys"), "observer-lost"});
  std::filesystem::copy(file("keys/observer-lost"), file("thief"));
  run_keys({"revoke", file("keys"), "observer-lost"});
  EXPECT_NE(run_keys({"list", file("keys")}).find("observer-lost"), std::string::npos);
  expect_refused(*program("render_client", with_keys("observer-old", {"--no-pictures"})),
                 "the keys of observer-old expired on 2024-02-03");
  expect_refused(*program("render_client", with_keys("observer-lost", {"--no-pictures"})),
                 "the keys of observer-lost were revoked");
  run_keys({"make", file("keys"), "--domain", std::to_string(network.domain == 0 ? 1 : 0), "observer-far"});
  expect_refused(*program("render_client", with_keys("observer-far", {"--no-pictures"})), "they are for domain ");
  std::filesystem::remove(file("keys/observer-far/revoked.pem"));
  expect_refused(*program("render_client", with_keys("observer-far", {"--no-pictures"})), "no revoked.pem can be read");
  const auto server = endless_server();
  const auto thief =
      program("render_client", in_session({"--no-pictures", "--duration-s", "3", "--keys", file("thief")}));
  EXPECT_EQ(thief->exit_code(), 1) << thief->output();
  EXPECT_TRUE(server->wait_for("with the keys of observer-lost: they are expired, revoked")) << server->output();
}

TEST_F(Security, a_gateway_with_keys_lets_a_browser_hold_an_instrument_and_lead) {
  const auto server = endless_server();
  const auto hand = program("device_bridge", with_keys("trainee-0", {"--device", "wish"}));
  const auto web = gateway({"--keys", file("keys/instructor")});
  test::WebPeer ada(port_of(*web), {"Ada", "theatre"});
  ASSERT_TRUE(ada.wait_until([&] { return ada.own_id() != kNobody && ada.scene; }));
  ada.say(LiveKind::claim, ToolClaim{0, ClaimAction::claim});
  const Vec3 place_m = ada.scene->camera.target_world_m + Vec3(0, 0, 0.06);
  const auto is_led = [&] {
    return ada.state && ada.state->tools[0].present &&
           (ada.state->tools[0].pose_world.position_m - place_m).norm() < 0.001;
  };
  EXPECT_TRUE(ada.wait_until(is_led, [&] { ada.wish(0, place_m); }));
  ada.say(LiveKind::order, SessionOrder{0, OrderKind::pause});
  EXPECT_TRUE(server->wait_for("paused")) << server->output();
}

TEST_F(Security, a_gateway_without_the_keys_of_an_instructor_has_nothing_for_a_browser) {
  const auto server = endless_server();
  const auto open = gateway();
  EXPECT_TRUE(open->wait_for("sim_server has keys, this program none (--keys)")) << open->output();
  expect_refused(*gateway({"--keys", file("keys/observer")}), "observer may not read contact_models");
  expect_refused(*gateway({"--keys", file("keys/trainee-0")}), "trainee-0 may not write session_orders");
  EXPECT_TRUE(server->wait_for(" has no keys, this program has")) << server->output();
  test::WebPeer ada(port_of(*open), {"Ada", "theatre"});
  ada.say(LiveKind::claim, ToolClaim{0, ClaimAction::claim});
  EXPECT_TRUE(ada.wait_until([&] { return ada.was_told("the scene has no such instrument"); }));
  EXPECT_FALSE(ada.scene);
  EXPECT_EQ(ada.states, 0u);
}

TEST_F(Security, what_leaves_the_machine_needs_keys_or_a_loud_word) {
  const Flags off{"--no-pictures", "--interface", "127.0.0.1", "--duration-s", "1"};
  expect_refused(*program("render_client", in_session(off)), "--interface: what leaves this machine needs keys");
  Flags open = off;
  open.push_back("--insecure");
  const auto screen = program("render_client", in_session(open));
  EXPECT_EQ(screen->exit_code(), 1) << screen->output();
  EXPECT_NE(screen->output().find("OPEN SESSION (--insecure)"), std::string::npos) << screen->output();
}

}  // namespace
}  // namespace sectio
