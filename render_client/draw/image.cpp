#include "render_client/draw/image.h"

#include <algorithm>
#include <cmath>

namespace sectio {

Image::Image(int width, int height, Colour background)
    : width_px(width), height_px(height), rgba(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
  for (std::size_t i = 0; i < rgba.size(); i += 4) {
    rgba[i] = background.r;
    rgba[i + 1] = background.g;
    rgba[i + 2] = background.b;
    rgba[i + 3] = background.a;
  }
}

void blend(Image& image, int x_px, int y_px, Colour colour, float coverage) {
  if (x_px < 0 || y_px < 0 || x_px >= image.width_px || y_px >= image.height_px) return;
  const float weight = std::clamp(coverage, 0.0f, 1.0f) * static_cast<float>(colour.a) / 255.0f;
  std::uint8_t* p = image.pixel(x_px, y_px);
  const auto mix = [weight](std::uint8_t from, std::uint8_t to) {
    return static_cast<std::uint8_t>(static_cast<float>(from) * (1 - weight) + static_cast<float>(to) * weight + 0.5f);
  };
  p[0] = mix(p[0], colour.r);
  p[1] = mix(p[1], colour.g);
  p[2] = mix(p[2], colour.b);
  p[3] = 255;
}

void fill(Image& image, const Rect& rect, Colour colour) {
  const int x_end = std::min(image.width_px, rect.x_px + rect.width_px);
  const int y_end = std::min(image.height_px, rect.y_px + rect.height_px);
  for (int y = std::max(0, rect.y_px); y < y_end; ++y) {
    for (int x = std::max(0, rect.x_px); x < x_end; ++x) blend(image, x, y, colour, 1.0f);
  }
}

namespace {

float distance_to_segment(const Eigen::Vector2f& p, const Eigen::Vector2f& a, const Eigen::Vector2f& b) {
  const Eigen::Vector2f ab = b - a;
  const float length2 = ab.squaredNorm();
  const float s = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0f, 1.0f) : 0.0f;
  return (p - a - s * ab).norm();
}

}  // namespace

void draw_polyline(Image& image, std::span<const Eigen::Vector2f> points_px, float width_px, Colour colour) {
  if (points_px.empty() || image.rgba.empty()) return;
  // Coverage is collected first and blended once, as the greatest over the segments.
  std::vector<float> coverage(image.rgba.size() / 4, 0.0f);
  const float reach = 0.5f * width_px + 0.5f;
  const Eigen::Vector2f lowest(-reach, -reach);
  const Eigen::Vector2f highest(static_cast<float>(image.width_px) + reach,
                                static_cast<float>(image.height_px) + reach);
  for (std::size_t i = 0; i + 1 < std::max<std::size_t>(points_px.size(), 2); ++i) {
    const Eigen::Vector2f& a = points_px[i];
    const Eigen::Vector2f& b = points_px[std::min(i + 1, points_px.size() - 1)];
    if (!a.allFinite() || !b.allFinite()) continue;
    const Eigen::Vector2f low = a.cwiseMin(b).cwiseMax(lowest).cwiseMin(highest);
    const Eigen::Vector2f high = a.cwiseMax(b).cwiseMax(lowest).cwiseMin(highest);
    const int x_end = std::min(image.width_px - 1, static_cast<int>(std::ceil(high.x() + reach)));
    const int y_end = std::min(image.height_px - 1, static_cast<int>(std::ceil(high.y() + reach)));
    for (int y = std::max(0, static_cast<int>(std::floor(low.y() - reach))); y <= y_end; ++y) {
      for (int x = std::max(0, static_cast<int>(std::floor(low.x() - reach))); x <= x_end; ++x) {
        const Eigen::Vector2f centre(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        float& c = coverage[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                            static_cast<std::size_t>(x)];
        c = std::max(c, std::clamp(reach - distance_to_segment(centre, a, b), 0.0f, 1.0f));
      }
    }
  }
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      const float c = coverage[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                               static_cast<std::size_t>(x)];
      if (c > 0) blend(image, x, y, colour, c);
    }
  }
}

void paste(Image& image, const Image& from, int x_px, int y_px) {
  const int x_begin = std::max(0, x_px);
  const int x_end = std::min(image.width_px, x_px + from.width_px);
  if (x_begin >= x_end) return;
  for (int y = std::max(0, y_px); y < std::min(image.height_px, y_px + from.height_px); ++y) {
    const std::uint8_t* row = from.pixel(x_begin - x_px, y - y_px);
    std::copy(row, row + 4 * (x_end - x_begin), image.pixel(x_begin, y));
  }
}

Image downscale(const Image& image, int width_px) {
  if (width_px >= image.width_px || width_px <= 0) return image;
  const int height_px = std::max(1, (image.height_px * width_px + image.width_px / 2) / image.width_px);
  Image small(width_px, height_px);
  const double step_x = static_cast<double>(image.width_px) / width_px;
  const double step_y = static_cast<double>(image.height_px) / height_px;
  for (int y = 0; y < height_px; ++y) {
    const double y0 = y * step_y, y1 = std::min<double>(image.height_px, y0 + step_y);
    for (int x = 0; x < width_px; ++x) {
      const double x0 = x * step_x, x1 = std::min<double>(image.width_px, x0 + step_x);
      Eigen::Vector4d sum = Eigen::Vector4d::Zero();
      double area = 0;
      for (int v = static_cast<int>(y0); v < y1; ++v) {
        const double part_y = std::min<double>(v + 1, y1) - std::max<double>(v, y0);
        for (int u = static_cast<int>(x0); u < x1; ++u) {
          const double weight = part_y * (std::min<double>(u + 1, x1) - std::max<double>(u, x0));
          const std::uint8_t* p = image.pixel(u, v);
          sum += weight * Eigen::Vector4d(p[0], p[1], p[2], p[3]);
          area += weight;
        }
      }
      std::uint8_t* q = small.pixel(x, y);
      for (int k = 0; k < 4; ++k) q[k] = static_cast<std::uint8_t>(sum[k] / area + 0.5);
    }
  }
  return small;
}

}  // namespace sectio
