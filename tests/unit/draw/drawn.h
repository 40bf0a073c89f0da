// The picture of a frame, on one small canvas that the tests of this folder share.
#pragma once

#include <memory>

#include "render_client/draw/draw_frame.h"

namespace sectio::test {

constexpr int kWidth = 480, kHeight = 270;

inline Canvas& shared_canvas() {
  static const std::unique_ptr<Canvas> canvas = make_osmesa_canvas(kWidth, kHeight);
  return *canvas;
}

inline Image drawn(const Frame& frame, const DrawOptions& options = {.overlay = false}) {
  FramePainter painter(shared_canvas());
  return painter.draw_frame(frame, options);
}

}  // namespace sectio::test
