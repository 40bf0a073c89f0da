// A mouse of a desktop without a screen (Xvfb), which is moved as a person would.
#include "common/math/trace.h"
#include "tests/support/session_programs.h"

namespace sectio {
namespace {

using test::Process;

class MouseOnDesktop : public test::SessionPrograms {};

TEST_F(MouseOnDesktop, leads_an_instrument) {
  const auto sim = server({"--endless"}, 0);
  const auto desk = at_a_desk(R"(cd "$1"
"$2/device_bridge" --device mouse:at_m=0/0/0.1,turn_deg=0 --record hand.csv --domain "$3" --session "$4" 2> bridge.log &
bridge=$!
until grep -q "servers: 1" bridge.log; do sleep 0.05; done
window=$(xdotool search --sync --name Sectio | head -n 1)
xdotool windowfocus "$window" mousemove 400 300
for i in {1..50}; do xdotool mousemove_relative -- 2 0; sleep 0.01; done
xdotool mousedown 1
for i in {1..50}; do xdotool mousemove_relative -- 0 2; sleep 0.01; done
xdotool mouseup 1
sleep 0.5
kill -INT $bridge
wait $bridge
echo "ended with $?"
)");
  ASSERT_TRUE(desk->exit_code()) << desk->output();
  EXPECT_NE(desk->output().find("ended with 0"), std::string::npos) << desk->output();
  const std::vector<TracePoint> moved = load_trace(file("hand.csv"));
  const Vec3 way_m = moved.back().pose_world.position_m - moved.front().pose_world.position_m;
  EXPECT_GT(way_m.x(), 0.003);
  EXPECT_LT(way_m.z(), -0.003);
  sim->send(SIGINT);
  EXPECT_EQ(sim->exit_code(), 0) << sim->output();
}

TEST_F(MouseOnDesktop, says_in_a_line_that_there_is_no_desktop) {
  Process desk("/usr/bin/env",
               {"-u", "DISPLAY", "SDL_VIDEODRIVER=x11", SECTIO_BIN_DIR "/device_bridge", "--device", "mouse"});
  EXPECT_EQ(desk.exit_code(), 2) << desk.output();
  EXPECT_NE(desk.output().find("--device mouse: no window can be opened"), std::string::npos) << desk.output();
}

}  // namespace
}  // namespace sectio
