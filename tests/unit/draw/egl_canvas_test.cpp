// EGL draws what OSMesa draws.
#include <gtest/gtest.h>

#include "common/core/error.h"
#include "render_client/draw/draw_frame.h"
#include "tests/unit/draw/picture_difference.h"
#include "tests/unit/draw/test_organ.h"

namespace sectio::draw_test {
namespace {

constexpr int kWidth_px = 322, kHeight_px = 181;

Image drawn_on(std::unique_ptr<Canvas> canvas, bool wireframe) {
  FramePainter painter(*canvas);
  return painter.draw_frame(test::make_frame(), {.wireframe = wireframe, .overlay = false});
}

TEST(EglCanvas, draws_the_picture_of_osmesa) {
  for (const int samples : {1, 4})
    for (const bool wireframe : {false, true}) {
      const Image osmesa = drawn_on(make_osmesa_canvas(kWidth_px, kHeight_px, samples), wireframe);
      const Image egl = drawn_on(make_egl_canvas(kWidth_px, kHeight_px, samples), wireframe);
      EXPECT_LE(test::pixels_that_differ(osmesa, egl, 8), kWidth_px * kHeight_px / 200) << samples;
      EXPECT_GT(test::pixels_that_differ(Image(kWidth_px, kHeight_px), egl, 8), kWidth_px * kHeight_px / 4);
    }
}

TEST(EglCanvas, refuses_what_no_canvas_can_be) {
  EXPECT_THROW(make_egl_canvas(0, 100), InputError);
  EXPECT_THROW(make_egl_canvas(100, 100, 3), InputError);
}

}  // namespace
}  // namespace sectio::draw_test
