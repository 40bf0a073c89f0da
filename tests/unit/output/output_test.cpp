#include <gtest/gtest.h>
#include <png.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "common/core/error.h"
#include "render_client/output/chart.h"
#include "render_client/output/contact_sheet.h"
#include "render_client/output/png.h"
#include "render_client/output/video.h"

namespace sectio::output_test {
namespace {

class Output : public testing::Test {
 protected:
  Output() {
    std::string pattern = (std::filesystem::temp_directory_path() / "sectio_output_XXXXXX").string();
    directory = ::mkdtemp(pattern.data());
  }
  ~Output() override { std::filesystem::remove_all(directory); }

  std::string directory;
};

Image striped(int width_px, int height_px) {
  Image image(width_px, height_px, {10, 20, 30, 255});
  fill(image, {0, 0, width_px / 2, height_px}, {200, 100, 50, 255});
  return image;
}

TEST_F(Output, a_png_reads_back_unchanged) {
  const Image image = striped(37, 21);
  write_png(directory + "/a.png", image);
  png_image png;
  std::memset(&png, 0, sizeof png);
  png.version = PNG_IMAGE_VERSION;
  ASSERT_TRUE(png_image_begin_read_from_file(&png, (directory + "/a.png").c_str()));
  png.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(png));
  ASSERT_TRUE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr));
  EXPECT_EQ(pixels, image.rgba);
}

TEST_F(Output, an_error_names_the_path_that_cannot_be_written) {
  std::ofstream(directory + "/file") << "x";
  const std::string inside_a_file = directory + "/file/frames";
  try {
    PngSequence sequence(inside_a_file);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(inside_a_file), std::string::npos);
  }
  EXPECT_THROW(write_png(directory + "/no/such/a.png", striped(4, 4)), InputError);
  EXPECT_THROW(VideoWriter(directory + "/no/such/a.mp4", 64, 64, 30), InputError);
}

TEST_F(Output, a_full_disk_is_an_error) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP();
  EXPECT_THROW(write_png("/dev/full", striped(400, 400)), InputError);
}

TEST_F(Output, sequence_counts_from_zero) {
  PngSequence sequence(directory + "/deep/frames");
  sequence.write(striped(8, 8));
  sequence.write(striped(8, 8));
  EXPECT_TRUE(std::filesystem::exists(directory + "/deep/frames/frame_000000.png"));
  EXPECT_TRUE(std::filesystem::exists(directory + "/deep/frames/frame_000001.png"));
}

TEST_F(Output, video_of_odd_size_is_an_mp4_with_its_index_in_front) {
  const std::string path = directory + "/a 'quoted' name.mp4";
  VideoWriter video(path, 65, 33, 30);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(video.write(striped(65, 33)));
  ASSERT_TRUE(video.finish());
  EXPECT_TRUE(video.finish());
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  ASSERT_NE(bytes.find("moov"), std::string::npos);
  EXPECT_LT(bytes.find("moov"), bytes.find("mdat"));
  EXPECT_NE(bytes.find("avc1"), std::string::npos);
}

TEST_F(Output, an_error_names_the_missing_encoder) {
  const std::string path_variable = std::getenv("PATH");
  ::setenv("PATH", directory.c_str(), 1);
  try {
    VideoWriter video(directory + "/a.mp4", 64, 64, 30);
    ADD_FAILURE() << "started";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("ffmpeg"), std::string::npos);
  }
  ::setenv("PATH", path_variable.c_str(), 1);
}

TEST_F(Output, a_dying_encoder_leaves_the_viewer_running) {
  const std::string fake = directory + "/ffmpeg";
  std::ofstream(fake) << "#!/bin/sh\nexit 3\n";
  std::filesystem::permissions(fake, std::filesystem::perms::owner_all);
  const std::string path_variable = std::getenv("PATH");
  ::setenv("PATH", (directory + ":" + path_variable).c_str(), 1);
  ::signal(SIGPIPE, SIG_DFL);
  VideoWriter video(directory + "/a.mp4", 640, 480, 30);
  ::setenv("PATH", path_variable.c_str(), 1);
  bool alive = true;
  for (int i = 0; alive && i < 100; ++i) alive = video.write(striped(640, 480));
  EXPECT_FALSE(alive);
  EXPECT_FALSE(video.finish());
}

TEST_F(Output, contact_sheet_has_every_tile) {
  std::vector<Shot> shots;
  for (int i = 0; i < 8; ++i) {
    shots.push_back({Image(160, 90, {static_cast<std::uint8_t>(40 + 20 * i), 90, 60, 255}), 0.5 * i});
  }
  const Image sheet = contact_sheet(shots, 4, 80);
  for (int i = 0; i < 8; ++i) {
    const int x = 6 + i % 4 * 86 + 40, y = 6 + i / 4 * (sheet.height_px - 6) / 2 + 20;
    EXPECT_EQ(sheet.pixel(x, y)[0], 40 + 20 * i) << i;
  }
}

TEST_F(Output, even_shots_are_spread_over_a_run_of_any_length) {
  for (const int length : {1, 5, 8, 31, 32, 33, 1000}) {
    EvenShots even(8, 16);
    for (int i = 0; i < length; ++i) even.offer(Image(16, 9), i);
    const std::vector<Shot> shots = even.shots();
    ASSERT_EQ(shots.size(), static_cast<std::size_t>(std::min(length, 8)));
    EXPECT_EQ(shots[0].sim_time_s, 0);
    EXPECT_GE(shots.back().sim_time_s, 0.9 * (length - 1));
    for (std::size_t i = 1; i < shots.size(); ++i) {
      const double gap = shots[i].sim_time_s - shots[i - 1].sim_time_s;
      EXPECT_GT(gap, 0);
      EXPECT_LT(gap, 2.0 * length / 8 + 1);
    }
  }
}

TEST(Chart, ticks_are_round) {
  EXPECT_EQ(round_ticks(0, 10, 5), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(round_ticks(-1, 1, 4), (std::vector<double>{-1, -0.5, 0, 0.5, 1}));
  EXPECT_TRUE(round_ticks(1, 1, 5).empty());
}

int count_reddish(const Image& image) {
  int count = 0;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) count += image.rgba[i] > image.rgba[i + 1] + 80;
  return count;
}

TEST(Chart, a_line_runs_through_its_points_and_breaks_at_nan) {
  Series line{"", {0, 1, 2, 3, 4}, {0, 1, 2, 3, 4}};
  const Image whole = plot({"rise", "time / s", "force / N"}, {line});
  // The middle of the data is the middle of the plot area, which begins at (72, 64).
  EXPECT_GT(whole.pixel(72 + (960 - 96) / 2, 64 + (480 - 120) / 2)[0], 150);
  EXPECT_LT(whole.pixel(72 + (960 - 96) / 2, 64 + (480 - 120) / 2)[1], 120);
  line.y[2] = std::numeric_limits<double>::quiet_NaN();
  const Image broken = plot({"rise", "time / s", "force / N"}, {line});
  EXPECT_NEAR(count_reddish(broken), count_reddish(whole) / 2, count_reddish(whole) / 10);
}

TEST(Chart, strange_data_are_drawn_or_refused) {
  plot({}, {});
  plot({}, {{"constant", {1, 2}, {5, 5}}, {"point", {1}, {0}}, {"none", {}, {}}});
  plot({}, {{"huge", {0, 1}, {-1e300, 1e300}}, {"inf", {0, 1}, {INFINITY, 1}}});
  EXPECT_THROW(plot({}, {{"unequal", {1, 2}, {1}}}), InputError);
}

// Two by two cells on logarithmic axes, one of them without a value, and a frontier between them.
TEST(HeatMap, cells_have_the_colours_of_their_values) {
  ChartLabels labels;
  labels.log_x = labels.log_y = true;
  HeatMap map{{1, 1, 100, 100}, {0.1, 10, 0.1, 10}, {0, 2, std::nan(""), 1}, "growth"};
  const Image plain = heat_map(labels, map, {}, 400, 300);
  const auto colour = [](const Image& image, int x, int y) {
    const std::uint8_t* p = image.pixel(x, y);
    return std::array<int, 3>{p[0], p[1], p[2]};
  };
  // The axes' area is 232 x 180 from (72, 64); quarters of it, off the lines of the grid.
  const auto low_left = colour(plain, 112, 217), high_left = colour(plain, 112, 92),
             low_right = colour(plain, 262, 217), high_right = colour(plain, 262, 92);
  EXPECT_GT(low_left[2], 230);
  EXPECT_LT(high_left[1], 60);
  EXPECT_EQ(low_right, (std::array<int, 3>{150, 154, 160}));
  EXPECT_EQ(high_right, (std::array<int, 3>{246, 186, 96}));
  map.high = 1;
  EXPECT_EQ(colour(heat_map(labels, map, {}, 400, 300), 262, 92), high_left) << "1 is as far as the colours go";
  const Series frontier{"limit", {1, 100}, {1, 1}, Series::Style::line};
  EXPECT_NE(heat_map(labels, map, {frontier}, 400, 300).rgba, heat_map(labels, map, {}, 400, 300).rgba);
  map.value.pop_back();
  EXPECT_THROW(heat_map(labels, map, {}, 400, 300), InputError);
}

}  // namespace
}  // namespace sectio::output_test
