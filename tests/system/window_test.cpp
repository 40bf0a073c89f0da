// A window on a desktop without a screen (Xvfb), to which keys are sent as a person would.
#include <filesystem>

#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Process;

class WindowOnDesktop : public test::SessionPrograms {};

TEST_F(WindowOnDesktop, shows_a_session_keeps_a_picture_and_closes_when_it_is_told) {
  const auto server = program("sim_server", in_session({"--scene", kScene, "--play-traces", "--endless"}));
  ASSERT_TRUE(server->wait_for("the session begins")) << server->output();
  const auto desk = at_a_desk(R"(cd "$1"
"$2/render_client" --window --size 320x240 --domain "$3" --session "$4" --name desk 2> viewer.log &
viewer=$!
until grep -q "on the screen" viewer.log; do sleep 0.05; done
window=$(xdotool search --sync --name Sectio | head -n 1)
xdotool windowfocus "$window"
until compgen -G "sectio_*_s.png"; do xdotool key p; sleep 0.2; done
xdotool mousemove 400 300 mousedown 1 mousemove 480 300 mouseup 1 key c key Next key c key Escape
wait $viewer
echo "ended with $?"
)");
  ASSERT_TRUE(desk->exit_code()) << desk->output();
  EXPECT_NE(desk->output().find("sectio_"), std::string::npos) << desk->output();
  EXPECT_NE(desk->output().find("client desk: body liver"), std::string::npos) << desk->output();
  EXPECT_NE(desk->output().find("ended with 0"), std::string::npos) << desk->output();
}

TEST_F(WindowOnDesktop, says_in_a_line_that_there_is_no_display) {
  Process desk("/usr/bin/env", {"-u", "DISPLAY", "SDL_VIDEODRIVER=x11", SECTIO_BIN_DIR "/render_client", "--window"});
  EXPECT_EQ(desk.exit_code(), 2) << desk.output();
  EXPECT_NE(desk.output().find("--window: there is no display"), std::string::npos) << desk.output();
}

}  // namespace
}  // namespace sectio
