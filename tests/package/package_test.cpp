// Programs as they are installed on a compute node, a program of somebody else that is built with the library, and a
// session under the care of systemd.
#include <cstdlib>
#include <filesystem>

#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Flags;
using test::Process;

class Package : public test::SessionPrograms {
 protected:
  std::string at(const std::string& path) const { return file("usr/" + path); }

  // Programs alone, or the library, too.
  void install(const std::string& component) const {
    Process cmake("/usr/bin/cmake", {"--install", SECTIO_BUILD_DIR, "--prefix", file("usr"), "--component", component});
    ASSERT_EQ(cmake.exit_code(), 0) << cmake.output();
  }
  static std::unique_ptr<Process> shell(const std::string& script, const Flags& words = {}) {
    Flags arguments{"-c", script, "bash"};
    arguments.insert(arguments.end(), words.begin(), words.end());
    return std::make_unique<Process>("/bin/bash", arguments);
  }
};

TEST_F(Package, runs_where_it_is_installed_with_its_manual_and_completion) {
  install("programs");
  Process server(at("bin/sim_server"),
                 {"--scene", at("share/sectio/scenes/bar_volume_cut.yaml"), "--offline", "--steps", "20"});
  EXPECT_EQ(server.exit_code(), 0) << server.output();
  const auto manual = shell("man --warnings -P cat -l \"$1\" 2>&1 >/dev/null; MANWIDTH=80 man -P cat -l \"$1\"",
                            {at("share/man/man1/sim_server-play.1")});
  EXPECT_EQ(manual->exit_code(), 0) << manual->output();
  EXPECT_EQ(manual->output().find("SIM_SERVER-PLAY(1)"), 0u) << manual->output();  // after no warning
  EXPECT_NE(manual->output().find("--from-s"), std::string::npos) << manual->output();
  const auto scripts = shell("man --warnings -P cat -l \"$1\"/sectio_keys.1 \"$1\"/sectio_session.1 2>&1 >/dev/null",
                             {at("share/man/man1")});
  EXPECT_EQ(scripts->exit_code(), 0) << scripts->output();
  EXPECT_EQ(scripts->output(), "");
  const auto completed = shell(
      "PATH=$1/bin:$PATH; source \"$1\"/share/bash-completion/completions/sim_server\n"
      "asked() { COMP_WORDS=(\"$@\") COMP_CWORD=$(($# - 1)); _sectio; echo \"[${COMPREPLY[*]}]\"; }\n"
      "asked sim_server pl; asked sim_server play --fr; asked sim_server --log-level w\n"
      "asked sim_server --scene a/b.yaml --exp; asked sim_server mesh a/b.obj --den",
      {file("usr")});
  EXPECT_EQ(completed->exit_code(), 0) << completed->output();
  EXPECT_NE(completed->output().find("[play plan]"), std::string::npos) << completed->output();
  EXPECT_NE(completed->output().find("[--from-s]"), std::string::npos) << completed->output();
  EXPECT_NE(completed->output().find("[warning]"), std::string::npos) << completed->output();
  EXPECT_NE(completed->output().find("[--export]\n[--density-kg-per-m3]\n"), std::string::npos) << completed->output();
}

TEST_F(Package, lets_a_program_of_somebody_else_follow_the_bodies_of_a_record) {
  const auto server = program("sim_server", in_session({"--scene", kScene, "--play-traces", "--steps", "1500",
                                                        "--record", file("a.mcap"), "--export", file("out")}));
  ASSERT_EQ(server->exit_code(), 0) << server->output();
  install("development");
  const auto built = shell(
      "cmake -S \"$1\" -B \"$2\" -DCMAKE_PREFIX_PATH=\"$3\" -DCMAKE_BUILD_TYPE=Release && "
      "cmake --build \"$2\"",
      {SECTIO_SOURCE_DIR "/tests/package/consumer", file("consumer"), file("usr")});
  ASSERT_EQ(built->exit_code(std::chrono::seconds(240)), 0) << built->output();
  Process consumer(file("consumer/consumer"), {file("a.mcap")});
  EXPECT_EQ(consumer.exit_code(), 0) << consumer.output();
  const nlohmann::json body = json("out/report.json")["bodies"][0];
  EXPECT_GT(body["revision"], 0);
  EXPECT_EQ(consumer.output(), "liver " + body["topology_hash"].get<std::string>().substr(0, 16) + "\n");
  Process without_a_record(file("consumer/consumer"), {});
  EXPECT_EQ(without_a_record.exit_code(), 2) << without_a_record.output();
}

TEST_F(Package, has_units_that_systemd_understands) {
  if (std::system("command -v systemd-analyze >/dev/null") != 0) GTEST_SKIP() << "no systemd-analyze on this machine";
  install("programs");
  // systemd looks for programs where the system has its own.
  const auto verified = shell(
      "for unit in server standby; do\n"
      "  sed \"s|^ExecStart=|&$1/bin/|\" \"$1/lib/systemd/system/sectio-$unit@.service\" "
      ">\"$1/sectio-$unit@liver.service\"\n"
      "  systemd-analyze verify --man=no --recursive-errors=no \"$1/sectio-$unit@liver.service\" || exit 1\ndone",
      {file("usr")});
  EXPECT_EQ(verified->exit_code(), 0) << verified->output();
  EXPECT_EQ(verified->output().find("sectio"), std::string::npos) << verified->output();
}

// The package as dpkg unpacks it, without its installation.
TEST_F(Package, has_the_command_for_keys_which_works_from_the_packages_paths) {
  if (std::system("command -v dpkg-deb >/dev/null") != 0) GTEST_SKIP() << "no dpkg on this machine";
  const auto unpacked = shell(
      "cpack --config \"$1/CPackConfig.cmake\" -B \"$2\" -D CPACK_COMPONENTS_ALL=programs "
      "-D CPACK_DEBIAN_PROGRAMS_PACKAGE_SHLIBDEPS=OFF && dpkg-deb -x \"$2\"/sectio_*.deb \"$2/root\"",
      {SECTIO_BUILD_DIR, file("packages")});
  ASSERT_EQ(unpacked->exit_code(std::chrono::seconds(300)), 0) << unpacked->output();
  const std::string root = file("packages/root");
  const auto keys = [&](const Flags& flags) {
    Process command(root + "/usr/bin/sectio_keys", flags);
    EXPECT_EQ(command.exit_code(), 0) << command.output();
    return command.output();
  };
  EXPECT_NE(keys({"--help"}).find("usage: sectio_keys make DIR"), std::string::npos);
  keys({"make", file("keys"), "server", "observer", "observer-lost"});
  EXPECT_NE(keys({"revoke", file("keys"), "observer-lost"}).find("observer-lost: revoked"), std::string::npos);
  EXPECT_NE(keys({"list", file("keys")}).find("observer "), std::string::npos);
  Process none(root + "/usr/bin/sectio_keys", {"list", file("nothing")});
  EXPECT_EQ(none.exit_code(), 2) << none.output();
  EXPECT_EQ(none.output(), "keys: " + file("nothing") + ": no keys were made there\n");

  const std::string scene = root + "/usr/share/sectio/scenes/liver_incision.yaml";
  Process server(root + "/usr/bin/sim_server", in_session({"--scene", scene, "--play-traces", "--wait-for-viewers", "1",
                                                           "--keys", file("keys/server")}));
  Process screen(root + "/usr/bin/render_client", in_session({"--no-pictures", "--keys", file("keys/observer")}));
  expect_equal_at_the_end(screen);
  EXPECT_EQ(server.exit_code(), 0) << server.output();
}

// The script of demo and live, before they begin in the directory of the session before.
TEST_F(Package, is_no_place_where_a_session_is_lost_whose_newest_try_has_not_ended) {
  const auto kept = shell(
      "mkdir -p \"$1/killed/try_2\" \"$1/ended/try_2\" && cd \"$1\" && touch ended/try_2/report.json &&\n"
      "for out in killed ended; do\n"
      "  touch -d '1 minute ago' $out/inputs && touch $out/report.json $out/try_2/inputs && \"$2\" $out demo || exit\n"
      "done\n"
      "ls killed/unfinished_*/report.json killed/unfinished_*/try_2/inputs ended/inputs",
      {directory.string(), SECTIO_SOURCE_DIR "/deploy/keep_unfinished"});
  EXPECT_EQ(kept->exit_code(), 0) << kept->output();
}

// By hand, as systemd does it: the program of the unit again after each end.
class Service : public Package {
 protected:
  void SetUp() override {
    install("programs");
    std::filesystem::create_directories(file("etc"));
    write("etc/liver_incision.flags", "# --steps 1 is no flag here\n--domain " + std::to_string(network.domain) +
                                          " --session " + network.session + " --play-traces\n");
  }
  std::unique_ptr<Process> service(const std::string& role) const {
    return shell(
        "SECTIO_ETC=$1/etc STATE_DIRECTORY=$1/var/$2 && export SECTIO_ETC STATE_DIRECTORY && "
        "mkdir -p \"$STATE_DIRECTORY\" && exec \"$1/usr/bin/sectio_session\" \"$2\" liver_incision",
        {directory.string(), role});
  }
  // With keys in the form in which systemd hands them to the unit.
  void load_keys(const std::string& identity) const {
    const auto made = shell(
        "\"$1/usr/bin/sectio_keys\" make \"$1/keys\" \"$2\" observer && mkdir \"$1/credentials\" && "
        "for path in \"$1/keys/$2\"/*; do install -m 400 \"$path\" \"$1/credentials/keys_${path##*/}\"; done && "
        "echo none >\"$1/credentials/keys\"",
        {directory.string(), identity});
    ASSERT_EQ(made->exit_code(), 0) << made->output();
    setenv("CREDENTIALS_DIRECTORY", file("credentials").c_str(), 1);
  }
  void TearDown() override { unsetenv("CREDENTIALS_DIRECTORY"); }
  std::string hash_after_replay(const std::string& inputs) const {
    const auto again = program("sim_server", {"replay", file(inputs)});
    EXPECT_EQ(again->exit_code(), 0) << again->output();
    return again->output();
  }
};

TEST_F(Service, that_is_killed_goes_on_where_it_was_and_begins_anew_after_its_end) {
  std::filesystem::create_directories(file("var/server/2.bak"));  // somebody's copy is no session
  auto server = service("server");
  ASSERT_TRUE(server->wait_for(" cuts")) << server->output();
  server->send(SIGKILL);
  ASSERT_TRUE(server->exit_code());
  server = service("server");
  ASSERT_TRUE(server->wait_for("the session goes on after step ")) << server->output();
  ASSERT_TRUE(server->wait_for_next(" cuts")) << server->output();
  server->send(SIGTERM);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_NE(hash_after_replay("var/server/1/inputs").find("liver: revision"), std::string::npos);
  server = service("server");
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  server->send(SIGTERM);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_TRUE(std::filesystem::exists(file("var/server/2/inputs")));
  server = service("server");
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  EXPECT_FALSE(std::filesystem::exists(file("var/server/1/checkpoints")));
  EXPECT_TRUE(std::filesystem::exists(file("var/server/2/checkpoints"))) << "those of the last one stay";
  server->send(SIGTERM);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
}

TEST_F(Service, refuses_another_role_and_a_scene_that_is_nowhere) {
  const auto other = service("leader");
  EXPECT_EQ(other->exit_code(), 2) << other->output();
  EXPECT_EQ(other->output(), "sectio_session: usage: sectio_session server|standby SCENE\n");
  const auto nowhere =
      shell("SECTIO_ETC=$1/etc exec \"$1/usr/bin/sectio_session\" server nowhere", {directory.string()});
  EXPECT_EQ(nowhere->exit_code(), 2) << nowhere->output();
  EXPECT_NE(nowhere->output().find(file("etc/scenes/nowhere.yaml") + ", "), std::string::npos) << nowhere->output();
  EXPECT_NE(nowhere->output().find("share/sectio/scenes/nowhere.yaml: neither is there\n"), std::string::npos)
      << nowhere->output();
}

TEST_F(Service, whose_standby_has_followed_it_stands_by_in_its_turn) {
  auto server = service("server");
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  const auto standby = service("standby");
  ASSERT_TRUE(standby->wait_for("it has caught up")) << standby->output();
  server->send(SIGKILL);
  ASSERT_TRUE(server->exit_code());
  ASSERT_TRUE(standby->wait_for("this one goes on after step")) << standby->output();
  server = service("server");
  ASSERT_TRUE(server->wait_for("it has caught up")) << server->output();
  standby->send(SIGKILL);
  ASSERT_TRUE(standby->exit_code());
  ASSERT_TRUE(server->wait_for("this one goes on after step")) << server->output();
  server->send(SIGTERM);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
}

TEST_F(Service, that_stood_by_goes_on_when_nobody_leads_once_it_has_led_itself) {
  auto server = service("server");
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  auto standby = service("standby");
  ASSERT_TRUE(standby->wait_for("it has caught up")) << standby->output();
  standby->send(SIGKILL);
  ASSERT_TRUE(standby->exit_code());
  server->send(SIGKILL);
  ASSERT_TRUE(server->exit_code());
  standby = service("standby");
  ASSERT_TRUE(standby->wait_for("no server of the session is there yet")) << standby->output();

  server = service("server");
  ASSERT_TRUE(standby->wait_for("it has caught up")) << standby->output();
  server->send(SIGKILL);
  ASSERT_TRUE(server->exit_code());
  ASSERT_TRUE(standby->wait_for("this one goes on after step")) << standby->output();
  ASSERT_TRUE(standby->wait_for_next(" cuts")) << standby->output();
  standby->send(SIGKILL);
  ASSERT_TRUE(standby->exit_code());
  standby = service("standby");
  ASSERT_TRUE(standby->wait_for("the session goes on after step ")) << standby->output();
  standby->send(SIGTERM);
  EXPECT_EQ(standby->exit_code(), 0) << standby->output();
}

// The second death comes before the server has caught up as a standby: its newest journal has less than the one before.
TEST_F(Service, that_dies_as_a_standby_too_goes_on_with_the_furthest_of_its_journals) {
  auto server = service("server");
  ASSERT_TRUE(server->wait_for(" cuts")) << server->output();
  server->send(SIGKILL);
  ASSERT_TRUE(server->exit_code());
  std::filesystem::create_directories(file("var/server/2"));
  const std::string inputs = file("var/server/1/inputs");
  std::filesystem::copy_file(inputs, file("var/server/2/inputs"));
  std::filesystem::resize_file(file("var/server/2/inputs"), std::filesystem::file_size(inputs) / 2);
  std::filesystem::create_directories(file("var/server/3"));
  std::filesystem::copy_file(inputs, file("var/server/3/inputs"));
  std::filesystem::resize_file(file("var/server/3/inputs"), 150);
  const auto unfinished =
      program("sim_server", {"unfinished", file("var/server/3"), file("var/server/2"), file("var/server/1")});
  EXPECT_EQ(unfinished->exit_code(), 0) << unfinished->output();
  const std::string furthest = unfinished->output().substr(0, unfinished->output().find('\n'));
  EXPECT_NE(furthest.find("\t" + file("var/server/1")), std::string::npos) << unfinished->output();

  server = service("server");
  ASSERT_TRUE(server->wait_for("the session goes on after step " + furthest.substr(0, furthest.find('\t'))))
      << server->output();
  server->send(SIGTERM);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
  EXPECT_TRUE(std::filesystem::exists(file("var/server/1/report.json")));
  server = service("server");
  ASSERT_TRUE(server->wait_for("the session begins")) << "what was left of the other journals is none to go on with\n"
                                                      << server->output();
  server->send(SIGTERM);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
}

TEST_F(Service, whose_keys_systemd_has_loaded_is_secured) {
  load_keys("server");
  auto server = service("server");
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  const auto open = program("render_client", in_session({"--no-pictures", "--duration-s", "3"}));
  EXPECT_EQ(open->exit_code(), 1) << open->output();
  EXPECT_NE(open->output().find("sim_server has keys, this program none (--keys)"), std::string::npos)
      << open->output();
  const auto screen = program("render_client", in_session({"--no-pictures", "--keys", file("keys/observer")}));
  ASSERT_TRUE(screen->wait_for("on the screen")) << screen->output();
  server->send(SIGKILL);
  ASSERT_TRUE(server->exit_code());
  server = service("server");
  ASSERT_TRUE(server->wait_for("the session goes on after step ")) << server->output();
  bool is_followed = false;
  for (int i = 0; i < 60 && !is_followed; ++i) {
    const auto status = program("sim_server", in_session({"status", "--keys", file("keys/observer")}));
    EXPECT_TRUE(status->exit_code()) << status->output();
    is_followed = status->output().find("viewer ") != std::string::npos;
  }
  EXPECT_TRUE(is_followed);
  server->send(SIGTERM);
  expect_equal_at_the_end(*screen);
  EXPECT_EQ(server->exit_code(), 0) << server->output();
}

TEST_F(Service, whose_keys_are_damaged_says_so_and_is_not_tried_again) {
  load_keys("server");
  write("credentials/keys_key.pem", "no key");
  const auto server = service("server");
  EXPECT_EQ(server->exit_code(), 2) << server->output();
  EXPECT_NE(server->output().find("key.pem is not that of cert.pem"), std::string::npos) << server->output();
}

}  // namespace
}  // namespace sectio
