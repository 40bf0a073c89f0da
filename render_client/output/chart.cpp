#include "render_client/output/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "common/core/error.h"
#include "render_client/draw/overlay.h"

namespace sectio {

namespace {

constexpr Colour kInk{45, 50, 58, 255};
constexpr Colour kGrid{224, 228, 232, 255};
constexpr std::array<Colour, 6> kColours{Colour{190, 40, 45},  Colour{35, 105, 180}, Colour{40, 140, 85},
                                         Colour{215, 135, 20}, Colour{120, 75, 165}, Colour{90, 95, 100}};

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void take(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  // Never empty or without width, a little room around.
  void settle(double room) {
    if (!(low <= high)) low = 0, high = 1;
    if (!(high - low > 1e-12 * std::max(std::abs(low), std::abs(high)))) {
      const double half = low == 0 ? 0.5 : 0.5 * std::abs(low);
      low -= half, high += half;
    }
    const double extra = room * (high - low);
    low -= extra, high += extra;
  }
};

double tick_step(double low, double high, int wanted) {
  const double raw = (high - low) / std::max(wanted, 1);
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double lead = raw / power;
  return power * (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10);
}

std::string tick_text(double value, double step) {
  std::array<char, 48> text{};
  if (step >= 1e6 || step < 1e-5) {
    std::snprintf(text.data(), text.size(), "%.3g", value);
  } else {
    const int decimals = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
    std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  }
  return text.data();
}

class Chart {
 public:
  Chart(const ChartLabels& labels, const std::vector<Series>& series, int width_px, int height_px);
  Image take() { return std::move(image_); }

 private:
  Eigen::Vector2f at(double x, double y) const {
    return Eigen::Vector2d(area_.x_px + (x - x_.low) / (x_.high - x_.low) * area_.width_px,
                           area_.y_px + (y_.high - y) / (y_.high - y_.low) * area_.height_px)
        .cast<float>();
  }
  void line(const Eigen::Vector2f& a, const Eigen::Vector2f& b, Colour colour) {
    draw_polyline(image_, std::array{a, b}, 1.0f, colour);
  }
  void draw_axes(const ChartLabels& labels);
  void draw_series(const Series& series, Colour colour);
  void draw_legend(const std::vector<Series>& series);

  Image image_;
  Text text_{14}, title_{18};
  Range x_, y_;
  bool whole_x_ = true;  // counts: no ticks between them
  Rect area_;
};

Chart::Chart(const ChartLabels& labels, const std::vector<Series>& series, int width_px, int height_px)
    : image_(width_px, height_px, {255, 255, 255, 255}) {
  for (const Series& s : series) {
    if (s.x.size() != s.y.size()) throw InputError("chart: series " + s.name + ": x and y differ in length");
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (!std::isfinite(s.x[i]) || !std::isfinite(s.y[i])) continue;
      x_.take(s.x[i]);
      whole_x_ = whole_x_ && s.x[i] == std::round(s.x[i]);
      y_.take(s.y[i]);
    }
  }
  if (labels.y_from_zero) y_.take(0);
  x_.settle(0);
  y_.settle(0.06);
  area_ = {72, 64, std::max(width_px - 72 - 24, 10), std::max(height_px - 64 - 56, 10)};
  draw_axes(labels);
  for (std::size_t i = 0; i < series.size(); ++i) draw_series(series[i], kColours[i % kColours.size()]);
  draw_legend(series);
}

void Chart::draw_axes(const ChartLabels& labels) {
  const int bottom = area_.y_px + area_.height_px;
  const int wanted_x = whole_x_ ? std::clamp(static_cast<int>(x_.high - x_.low), 1, 9) : 9;
  const double step_x = tick_step(x_.low, x_.high, wanted_x), step_y = tick_step(y_.low, y_.high, 6);
  for (const double x : round_ticks(x_.low, x_.high, wanted_x)) {
    const Eigen::Vector2f p = at(x, y_.low);
    line(p, at(x, y_.high), kGrid);
    const std::string text = tick_text(x, step_x);
    text_.draw(image_, static_cast<int>(p.x()) - text_.width_px(text) / 2, bottom + 5, text, kInk);
  }
  for (const double y : round_ticks(y_.low, y_.high, 6)) {
    const Eigen::Vector2f p = at(x_.low, y);
    line(p, at(x_.high, y), kGrid);
    const std::string text = tick_text(y, step_y);
    text_.draw(image_, area_.x_px - 8 - text_.width_px(text), static_cast<int>(p.y()) - text_.line_height_px() / 2,
               text, kInk);
  }
  line(at(x_.low, y_.low), at(x_.high, y_.low), kInk);
  line(at(x_.low, y_.low), at(x_.low, y_.high), kInk);
  title_.draw(image_, area_.x_px, 8, labels.title, kInk);
  text_.draw(image_, 12, area_.y_px - 6 - text_.line_height_px(), labels.y, kInk);
  text_.draw(image_, area_.x_px + (area_.width_px - text_.width_px(labels.x)) / 2, bottom + 27, labels.x, kInk);
}

void Chart::draw_series(const Series& series, Colour colour) {
  std::vector<Eigen::Vector2f> run;
  const auto flush = [&] {
    draw_polyline(image_, run, 1.8f, colour);
    run.clear();
  };
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (std::isfinite(series.x[i]) && std::isfinite(series.y[i])) {
      run.push_back(at(series.x[i], series.y[i]));
    } else {
      flush();
    }
  }
  flush();
}

void Chart::draw_legend(const std::vector<Series>& series) {
  int x = area_.x_px + area_.width_px;
  for (std::size_t i = series.size(); i-- > 0;) {
    if (series[i].name.empty()) continue;
    x -= text_.width_px(series[i].name) + 8;
    const int y = area_.y_px - 6 - text_.line_height_px();
    text_.draw(image_, x + 8, y, series[i].name, kInk);
    fill(image_, {x - 20, y + text_.line_height_px() / 2 - 1, 22, 3}, kColours[i % kColours.size()]);
    x -= 36;
  }
}

}  // namespace

std::vector<double> round_ticks(double low, double high, int wanted) {
  std::vector<double> ticks;
  if (!(high > low) || !std::isfinite(high - low)) return ticks;
  const double step = tick_step(low, high, wanted);
  const double first = std::ceil(low / step - 1e-9);
  for (int i = 0; i < 4 * std::max(wanted, 1) + 4 && (first + i) * step <= high + 1e-9 * step; ++i) {
    ticks.push_back((first + i) * step + 0.0);  // + 0.0: no "-0"
  }
  return ticks;
}

Image plot(const ChartLabels& labels, const std::vector<Series>& series, int width_px, int height_px) {
  return Chart(labels, series, width_px, height_px).take();
}

}  // namespace sectio
