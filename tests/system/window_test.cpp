// A window on a desktop without a screen (Xvfb): keys are sent, and the picture on the screen is looked at.
#include <filesystem>
#include <fstream>
#include <iterator>

#include "render_client/draw/image.h"
#include "tests/support/session_programs.h"
#include "tests/unit/draw/picture_difference.h"

namespace sectio {
namespace {

using test::Process;

constexpr int kWidth_px = 480, kHeight_px = 360, kDeskWidth_px = 800, kDeskHeight_px = 600;
constexpr std::chrono::seconds kWithXvfb(240);

// A picture of the screen is waited for: until it is another than the last one, and stays.
constexpr const char* kHands = R"sh(cd "$1"; bin=$2; net=(--domain "$3" --session "$4")
open_window() { # CANVAS FLAGS...
  "$bin/render_client" --window --size 480x360 "${net[@]}" --name desk --canvas "$@" 2> viewer.log &
  viewer=$!
  until grep -q "on the screen" viewer.log; do kill -0 $viewer || { cat viewer.log; exit 1; }; sleep 0.05; done
  window=$(xdotool search --sync --onlyvisible --name Sectio | head -n 1)
  xdotool windowfocus --sync "$window" mousemove 5 5
}
close_window() { xdotool key Escape; wait $viewer; echo "ended with $?"; }
place_of_window() { eval "$(xdotool getwindowgeometry --shell "$window")"; place=${WIDTH}x$HEIGHT+$X+$Y; }
shoot() { # FILE: takes $place of the screen
  local w h x y
  IFS=x+ read -r w h x y <<< "$place"
  ffmpeg -nostdin -loglevel error -y -f x11grab -draw_mouse 0 -video_size "${w}x$h" -i "$DISPLAY+$x,$y" \
    -frames:v 1 -f rawvideo -pix_fmt rgba "$1"
}
moves() { shoot a; until shoot b && ! cmp -s a b; do :; done; }
shows() { shoot "$1" && (($(tr -d '\0\377' < "$1" | wc -c) > 100000)); } # something, and not black
stays() { shoot again && cmp -s "$1" again; }
changed() { until shoot "$1" && ! cmp -s "$1" "$last" && stays "$1"; do :; done; last=$1; }
press() { xdotool key "$1"; changed "$2"; }
halt() { xdotool key space; until shoot "$1" && stays "$1" && stays "$1"; do :; done; last=$1; }
keep() { # tells the time in the name of a new picture
  rm -f sectio_*_s.png
  until compgen -G "sectio_*_s.png" > names; do xdotool key p; sleep 0.1; done
  sed 's/sectio_\(.*\)_s.png/\1/; q' names
}
later() { local from; from=$(keep); until awk "BEGIN { exit !($(keep) > $from + $1) }"; do :; done; }
)sh";

class WindowOnDesktop : public test::SessionPrograms {
 protected:
  std::unique_ptr<Process> play() const {
    return program("sim_server",
                   in_session({"--scene", kScene, "--play-traces", "--endless", "--wait-for-viewers", "1"}));
  }
  std::string output_of(const std::string& script) const {
    const auto desk = at_a_desk(kHands + script);
    EXPECT_EQ(desk->exit_code(kWithXvfb), 0) << desk->output();
    return desk->output();
  }
  Image picture(const std::string& name, int width_px = kWidth_px, int height_px = kHeight_px) const {
    std::ifstream stream(file(name), std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
    Image image(width_px, height_px);
    EXPECT_EQ(bytes.size(), image.rgba.size()) << name;
    if (bytes.size() == image.rgba.size()) std::copy(bytes.begin(), bytes.end(), image.rgba.begin());
    return image;
  }
  void expect_same(const std::string& a, const std::string& b) const {
    EXPECT_EQ(test::pixels_that_differ(picture(a), picture(b), 0), 0) << a << " and " << b;
  }
};

Image part(const Image& image, const Rect& rect) {
  Image cut(rect.width_px, rect.height_px);
  for (int y = 0; y < rect.height_px; ++y)
    std::copy_n(image.pixel(rect.x_px, rect.y_px + y), 4 * rect.width_px, cut.pixel(0, y));
  return cut;
}
double share_that_differs(const Image& a, const Image& b) {
  return static_cast<double>(test::pixels_that_differ(a, b, 8)) / (a.width_px * a.height_px);
}
// How many of the pixels that differ are darker in `b`.
double share_darker(const Image& a, const Image& b) {
  int darker = 0, differ = 0;
  for (int y = 0; y < a.height_px; ++y)
    for (int x = 0; x < a.width_px; ++x) {
      if (test::difference(a, b, x, y) <= 8) continue;
      ++differ;
      darker += b.pixel(x, y)[0] < a.pixel(x, y)[0];
    }
  return static_cast<double>(darker) / std::max(differ, 1);
}

class CanvasOfWindow : public WindowOnDesktop, public testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(Desktop, CanvasOfWindow, testing::Values("osmesa", "window"));

TEST_P(CanvasOfWindow, keys_change_the_picture_as_they_should_and_change_it_back) {
  const auto server = play();
  const std::string output = output_of(std::string("open_window ") + GetParam() + R"( --no-panel
place_of_window
moves
halt halted
press w wireframe
press w plain
press c section
press Next deeper
press c whole
press s stereo
press s one_eye
xdotool mousemove 400 300 mousedown 1 mousemove 480 320 mouseup 1; changed turned
press Home home
keep
until ffmpeg -nostdin -loglevel error -y -i sectio_*_s.png -f rawvideo -pix_fmt rgba kept; do :; done
xdotool key h; until shoot panel && ! cmp -s panel home; do :; done
xdotool mousemove 400 140 mousedown 1 mousemove 440 200 mouseup 1 mousemove 5 5
xdotool key h; until shoot hidden && cmp -s hidden home; do :; done
close_window
)");
  EXPECT_NE(output.find("client desk: body liver"), std::string::npos) << output;
  EXPECT_NE(output.find("ended with 0"), std::string::npos) << output;

  for (const char* again : {"plain", "whole", "one_eye", "home", "kept", "hidden"}) expect_same("halted", again);
  const Image halted = picture("halted");
  const Image wireframe = picture("wireframe");
  EXPECT_GT(share_that_differs(halted, wireframe), 0.15);
  EXPECT_GT(share_darker(halted, wireframe), 0.9) << "edges are dark";
  const Rect backdrop{0, 0, 60, 30}, middle{160, 160, 160, 160};
  EXPECT_EQ(share_that_differs(part(halted, backdrop), part(wireframe, backdrop)), 0) << "nothing is there";

  const Image section = picture("section");
  EXPECT_GT(share_that_differs(part(halted, middle), part(section, middle)), 0.8) << "the plane";
  EXPECT_LT(share_that_differs(part(halted, {0, 0, kWidth_px, 60}), part(section, {0, 0, kWidth_px, 60})), 0.1)
      << "tissue behind the plane, and the instrument, stay";
  EXPECT_GT(share_that_differs(section, picture("deeper")), 0.01);

  const Image stereo = picture("stereo");
  const Image left = part(stereo, {0, 0, kWidth_px / 2, kHeight_px}),
              right = part(stereo, {kWidth_px / 2, 0, kWidth_px / 2, kHeight_px});
  EXPECT_GT(share_that_differs(left, right), 0.02) << "the eyes are apart";
  EXPECT_LT(test::mean_difference(left, right),
            0.5 * test::mean_difference(part(halted, {0, 0, kWidth_px / 2, kHeight_px}),
                                        part(halted, {kWidth_px / 2, 0, kWidth_px / 2, kHeight_px})))
      << "both see the same";
  EXPECT_GT(share_that_differs(halted, picture("turned")), 0.2);

  const Image panel = picture("panel");
  EXPECT_GT(share_darker(halted, panel), 0.8) << "it is dark";
  EXPECT_GT(share_that_differs(part(halted, {20, 40, 280, 200}), part(panel, {20, 40, 280, 200})), 0.9);
  EXPECT_EQ(share_that_differs(part(halted, {320, 0, 160, 360}), part(panel, {320, 0, 160, 360})), 0) << "beside it";
}

TEST_P(CanvasOfWindow, follows_an_instrument) {
  const auto server = play();
  output_of(std::string("open_window ") + GetParam() + R"( --no-panel
"$bin/sim_server" speed "${net[@]}" --factor 0.2
place_of_window
moves
halt halted
xdotool key 1 space
later 0.6
halt followed
press Home first_view
close_window
)");
  const Image halted = picture("halted");
  const double by_instrument = share_that_differs(halted, picture("first_view")),
               by_view = share_that_differs(halted, picture("followed"));
  EXPECT_GT(by_instrument, 0) << "the session went on";
  EXPECT_GT(by_view, 0.1);
  EXPECT_GT(by_view, 2 * by_instrument) << "the view moves, and not only the instrument";
}

// The slider is in one of the first rows of the panel, where nothing else of that column is to be clicked.
TEST_F(WindowOnDesktop, of_somebody_who_leads_pauses_the_session_and_goes_back_in_time) {
  const auto server = program("sim_server", in_session({"--scene", kScene, "--play-traces", "--endless",
                                                        "--wait-for-viewers", "1", "--export", file("out")}));
  const auto desk = at_a_desk(std::string(kHands) + R"(open_window osmesa --lead
later 1.5
xdotool key Return
until "$bin/sim_server" status "${net[@]}" | grep paused; do :; done
xdotool key BackSpace
until [[ -d out/try_2 ]]; do sleep 0.05; done
xdotool key Return
while "$bin/sim_server" status "${net[@]}" | grep paused; do :; done
later 1
xdotool mousemove 5 5
for y in $(seq 60 5 200); do
  xdotool mousemove --window "$window" 120 "$y" sleep 0.1 mousedown 1 sleep 0.1 mouseup 1
  for i in $(seq 10); do [[ -d out/try_3 ]] && break 2; sleep 0.1; done
done
close_window
)");
  EXPECT_EQ(desk->exit_code(kWithXvfb), 0) << desk->output();
  EXPECT_NE(desk->output().find("ended with 0"), std::string::npos) << desk->output();
  server->send(SIGINT);
  EXPECT_TRUE(server->exit_code());
  const std::string said = server->output(), from = "the session goes on from ";
  EXPECT_EQ(said.find(from), said.find(from + "0.00 s")) << "ten seconds back is before the beginning: " << said;
  EXPECT_NE(said.rfind(from), said.find(from)) << "the slider: " << said;
  EXPECT_NE(said.rfind(from), said.rfind(from + "0.00 s")) << "it was in its middle: " << said;
  EXPECT_EQ(said.find("seek: "), std::string::npos) << "nothing was refused: " << said;
}

TEST_F(WindowOnDesktop, leads_only_as_a_window) {
  const auto without = program("render_client", {"--lead", "--no-pictures"});
  EXPECT_EQ(without->exit_code(), 2) << without->output();
  EXPECT_NE(without->output().find("--lead: only with --window"), std::string::npos) << without->output();
}

TEST_P(CanvasOfWindow, covers_the_screen_and_comes_back) {
  const auto server = play();
  output_of("matchbox-window-manager &\nopen_window " + std::string(GetParam()) + R"( --no-panel
place=800x600+0+0
moves
halt windowed
press f full
press f back
close_window
kill %1
)");
  const Image windowed = picture("windowed", kDeskWidth_px, kDeskHeight_px),
              full = picture("full", kDeskWidth_px, kDeskHeight_px);
  EXPECT_EQ(test::pixels_that_differ(windowed, picture("back", kDeskWidth_px, kDeskHeight_px), 0), 0);
  const Rect title{200, 2, 400, 10};
  EXPECT_GT(share_that_differs(part(windowed, title), part(full, title)), 0.9) << "it has no title any more";
}

TEST_F(WindowOnDesktop, its_own_opengl_draws_what_software_draws) {
  const auto server = play();
  output_of(R"(open_window osmesa --no-panel
place_of_window
moves
"$bin/sim_server" pause "${net[@]}"
until shows software && stays software && stays software; do :; done
close_window
open_window window --no-panel
place_of_window
until shows opengl && stays opengl && stays opengl; do :; done
close_window
)");
  EXPECT_LE(share_that_differs(picture("software"), picture("opengl")), 1.0 / 200);
  EXPECT_GT(share_that_differs(Image(kWidth_px, kHeight_px), picture("opengl")), 0.25);
}

TEST_F(WindowOnDesktop, says_in_a_line_that_there_is_no_display) {
  Process desk("/usr/bin/env", {"-u", "DISPLAY", "SDL_VIDEODRIVER=x11", SECTIO_BIN_DIR "/render_client", "--window"});
  EXPECT_EQ(desk.exit_code(), 2) << desk.output();
  EXPECT_NE(desk.output().find("--window: there is no display"), std::string::npos) << desk.output();
}

TEST_F(WindowOnDesktop, says_in_a_line_that_there_is_no_opengl_and_that_its_canvas_needs_a_window) {
  Process desk("/usr/bin/xvfb-run",
               {"-a", "-s", "-screen 0 800x600x24 -extension GLX", "/bin/sh", "-c",
                "\"$0\" --window --canvas window; echo \"code $?\"", SECTIO_BIN_DIR "/render_client"});
  EXPECT_TRUE(desk.exit_code()) << desk.output();  // its own: the X server may still be writing while it cleans up
  EXPECT_NE(desk.output().find("code 2\n"), std::string::npos) << desk.output();
  EXPECT_NE(desk.output().find("--canvas window: "), std::string::npos) << desk.output();
  const auto without = program("render_client", {"--canvas", "window"});
  EXPECT_EQ(without->exit_code(), 2) << without->output();
  EXPECT_NE(without->output().find("--canvas window: only with --window"), std::string::npos) << without->output();
}

}  // namespace
}  // namespace sectio
