// A picture in memory and the raster operations of overlays, charts and contact sheets. It needs no graphics library.
// Coordinates are pixels, origin at the top left, y down. All operations clip to the picture.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace sectio {

struct Colour {
  std::uint8_t r = 0, g = 0, b = 0, a = 255;
};

struct Rect {
  int x_px = 0, y_px = 0, width_px = 0, height_px = 0;
};

struct Image {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> rgba;  // top row first, 4 bytes a pixel

  Image() = default;
  Image(int width, int height, Colour background = {0, 0, 0, 255});

  std::uint8_t* pixel(int x_px, int y_px) { return rgba.data() + offset(x_px, y_px); }
  const std::uint8_t* pixel(int x_px, int y_px) const { return rgba.data() + offset(x_px, y_px); }

 private:
  std::size_t offset(int x_px, int y_px) const {
    return 4 * (static_cast<std::size_t>(y_px) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(x_px));
  }
};

// Mixes the colour into one pixel with weight coverage x colour.a; the picture stays opaque.
void blend(Image& image, int x_px, int y_px, Colour colour, float coverage);

void fill(Image& image, const Rect& rect, Colour colour);

// An anti-aliased line through the points with round joints. It is not darker where it crosses itself.
void draw_polyline(Image& image, std::span<const Eigen::Vector2f> points_px, float width_px, Colour colour);

void paste(Image& image, const Image& from, int x_px, int y_px);

// The picture at a smaller width with the same aspect: every pixel is the mean of the area that it covers.
Image downscale(const Image& image, int width_px);

}  // namespace sectio
