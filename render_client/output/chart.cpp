#include "render_client/output/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "render_client/draw/overlay.h"
#include "render_client/output/heat_cells.h"

namespace sectio {

namespace {

constexpr Colour kInk{45, 50, 58, 255};
constexpr Colour kGrid{224, 228, 232, 255};
constexpr std::array<Colour, 4> kFaintColours{Colour{120, 126, 134, 255}, Colour{178, 158, 128, 255},
                                              Colour{160, 190, 195, 255}, Colour{196, 178, 204, 255}};
constexpr std::array<Colour, 6> kColours{Colour{190, 40, 45},  Colour{35, 105, 180}, Colour{40, 140, 85},
                                         Colour{215, 135, 20}, Colour{120, 75, 165}, Colour{90, 95, 100}};

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  // Makes an empty or flat range a proper one, then adds a share of its width at both ends.
  void pad(double room) {
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
  if (step >= 1e6 || step < 1e-5) return formatted("%.3g", value);
  const int decimals = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  return formatted("%.*f", decimals, value);
}

constexpr std::size_t kMaxNamesAbove = 6;  // series whose names have room above the chart

Colour colour_of(const std::vector<Series>& series, std::size_t i) {
  if (series[i].style == Series::Style::dashes) return kInk;
  std::size_t own = 0, faint = 0;
  for (std::size_t k = 0; k < i; ++k) ++(series[k].faint ? faint : own);
  return series[i].faint ? kFaintColours[faint % kFaintColours.size()] : kColours[own % kColours.size()];
}

// Ticks of a logarithmic axis, in decades: 1, 2 and 5 times each power of ten, or the powers alone when there are many.
std::vector<double> decades(double low, double high) {
  std::vector<double> ticks;
  for (double power = std::floor(low); power <= high; power += 1)
    for (const double lead : {1.0, 2.0, 5.0}) {
      const double tick = power + std::log10(lead);
      if (tick >= low && tick <= high && (lead == 1 || high - low < 3)) ticks.push_back(tick);
    }
  return ticks;
}

std::string decade_text(double decade) {
  return formatted("%.3g", std::pow(10.0, decade));
}

class Chart {
 public:
  Chart(const ChartLabels& labels, const std::vector<Series>& series, int width_px, int height_px,
        const HeatMap* heat = nullptr);
  Image take() { return std::move(image_); }

 private:
  // Positions along an axis are in the axis's own scale: in decades when it is logarithmic.
  double scaled_x(double x) const { return labels_.log_x ? std::log10(x) : x; }
  double scaled_y(double y) const { return labels_.log_y ? std::log10(y) : y; }
  bool has_place(double x, double y) const { return std::isfinite(scaled_x(x)) && std::isfinite(scaled_y(y)); }
  bool is_inside(double x, double y) const {
    return scaled_x(x) >= x_.low && scaled_x(x) <= x_.high && scaled_y(y) >= y_.low && scaled_y(y) <= y_.high;
  }
  Eigen::Vector2f at(double x, double y) const {
    return Eigen::Vector2d(area_.x_px + (x - x_.low) / (x_.high - x_.low) * area_.width_px,
                           area_.y_px + (y_.high - y) / (y_.high - y_.low) * area_.height_px)
        .cast<float>();
  }
  void line(const Eigen::Vector2f& a, const Eigen::Vector2f& b, Colour colour) {
    draw_polyline(image_, std::array{a, b}, 1.0f, colour);
  }
  void dash(const Eigen::Vector2f& a, const Eigen::Vector2f& b, Colour colour) {
    const Eigen::Vector2f along = (b - a).stableNormalized();
    for (float s = 0; s < (b - a).norm(); s += 10)
      draw_polyline(image_, std::array<Eigen::Vector2f, 2>{a + s * along, a + std::min(s + 6, (b - a).norm()) * along},
                    1.6f, colour);
  }
  void draw_cells(const HeatMap& heat);
  void draw_scale(const HeatMap& heat, const Range& values);
  void draw_axes();
  void draw_marks();
  void draw_series(const Series& series, Colour colour);
  void draw_dot(const Eigen::Vector2f& at, Colour colour);
  void draw_legend(const std::vector<Series>& series);
  void draw_legend_beside(const std::vector<Series>& series);

  const ChartLabels& labels_;
  Image image_;
  Text text_{14}, title_{18};
  Range x_, y_;
  bool whole_x_ = true;  // all x are whole numbers: no ticks between them
  Rect area_;
};

Chart::Chart(const ChartLabels& labels, const std::vector<Series>& series, int width_px, int height_px,
             const HeatMap* heat)
    : labels_(labels), image_(width_px, height_px, {255, 255, 255, 255}) {
  for (const Series& s : series) {
    if (s.x.size() != s.y.size()) throw InputError("chart: series " + s.name + ": x and y differ in length");
    for (std::size_t i = 0; i < s.x.size() && !heat; ++i) {
      if (!has_place(s.x[i], s.y[i])) continue;
      x_.include(scaled_x(s.x[i]));
      whole_x_ = whole_x_ && s.x[i] == std::round(s.x[i]);
      y_.include(scaled_y(s.y[i]));
    }
  }
  const bool beside = series.size() > kMaxNamesAbove;
  int right = heat ? 96 : 24;
  for (std::size_t i = 0; i < series.size() && beside; ++i)
    right = std::max(right, 56 + text_.width_px(series[i].name));
  area_ = {72, 64, std::max(width_px - 72 - right, 10), std::max(height_px - 64 - 56, 10)};
  if (heat) {
    draw_cells(*heat);
  } else {
    if (labels.y_from_zero) y_.include(0);
    x_.pad(labels.log_x ? 0.03 : 0);
    y_.pad(0.06);
  }
  whole_x_ = whole_x_ && !labels.log_x && !heat;
  draw_axes();
  draw_marks();
  for (const bool faint : {true, false})
    for (std::size_t i = 0; i < series.size(); ++i)
      if (series[i].faint == faint) draw_series(series[i], colour_of(series, i));
  if (beside)
    draw_legend_beside(series);
  else
    draw_legend(series);
}

void Chart::draw_cells(const HeatMap& heat) {
  if (heat.x.size() != heat.y.size() || heat.x.size() != heat.value.size())
    throw InputError("chart: " + heat.name + ": cells differ in number");
  std::vector<double> xs, ys;
  Range values;
  for (std::size_t i = 0; i < heat.x.size(); ++i) {
    if (!has_place(heat.x[i], heat.y[i])) continue;
    xs.push_back(scaled_x(heat.x[i]));
    ys.push_back(scaled_y(heat.y[i]));
    if (std::isfinite(heat.value[i])) values.include(heat.value[i]);
  }
  values = {heat.low.value_or(values.low), heat.high.value_or(values.high)};
  values.pad(0);
  const CellEdges across(xs), up(ys);
  x_ = {across.low(), across.high()};
  y_ = {up.low(), up.high()};
  for (std::size_t i = 0; i < heat.x.size(); ++i) {
    if (!has_place(heat.x[i], heat.y[i])) continue;
    const auto [left, right] = across.of(scaled_x(heat.x[i]));
    const auto [low, high] = up.of(scaled_y(heat.y[i]));
    const Eigen::Vector2i a = at(left, high).array().round().cast<int>(),
                          b = at(right, low).array().round().cast<int>();
    fill(image_, {a.x(), a.y(), b.x() - a.x(), b.y() - a.y()},
         heat_colour((heat.value[i] - values.low) / (values.high - values.low)));
  }
  draw_scale(heat, values);
}

void Chart::draw_scale(const HeatMap& heat, const Range& values) {
  const int x = area_.x_px + area_.width_px + 18, height = area_.height_px;
  for (int row = 0; row < height; ++row)
    fill(image_, {x, area_.y_px + row, 16, 1}, heat_colour(1 - double(row) / (height - 1)));
  const double step = tick_step(values.low, values.high, 5);
  for (const double value : round_ticks(values.low, values.high, 5)) {
    const int y =
        area_.y_px + static_cast<int>(std::lround((values.high - value) / (values.high - values.low) * height));
    text_.draw(image_, x + 22, y - text_.line_height_px() / 2, tick_text(value, step), kInk);
  }
  text_.draw(image_, image_.width_px - 8 - text_.width_px(heat.name), area_.y_px - 8 - 2 * text_.line_height_px(),
             heat.name, kInk);
}

void Chart::draw_marks() {
  for (const ChartLabels::Mark& mark : labels_.marks) {
    const double x = scaled_x(mark.x);
    if (!(x >= x_.low && x <= x_.high)) continue;
    line(at(x, y_.low), at(x, y_.high), kInk);
    const Eigen::Vector2f top = at(x, y_.high);
    text_.draw(image_, static_cast<int>(top.x()) - text_.width_px(mark.name) - 6, static_cast<int>(top.y()) + 4,
               mark.name, kInk);
  }
}

void Chart::draw_dot(const Eigen::Vector2f& at, Colour colour) {
  constexpr int kRadius = 4;
  for (int row = -kRadius; row <= kRadius; ++row) {
    const int half = static_cast<int>(std::lround(std::sqrt(kRadius * kRadius + 2 - row * row)));
    fill(image_, {static_cast<int>(at.x()) - half, static_cast<int>(at.y()) + row, 2 * half + 1, 1}, colour);
  }
}

void Chart::draw_legend_beside(const std::vector<Series>& series) {
  int y = area_.y_px;
  const int x = area_.x_px + area_.width_px + 14;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (series[i].name.empty()) continue;
    const int middle_px = y + text_.line_height_px() / 2;
    const Eigen::Vector2f left(static_cast<float>(x), static_cast<float>(middle_px));
    if (series[i].style == Series::Style::dashes)
      for (int k = 0; k < 3; ++k)
        line(left + Eigen::Vector2f(static_cast<float>(8 * k), 0),
             left + Eigen::Vector2f(static_cast<float>(8 * k + 5), 0), colour_of(series, i));
    else
      draw_dot(left + Eigen::Vector2f(10, 0), colour_of(series, i));
    text_.draw(image_, x + 28, y, series[i].name, kInk);
    y += text_.line_height_px() + 6;
  }
}

void Chart::draw_axes() {
  const ChartLabels& labels = labels_;
  const int bottom = area_.y_px + area_.height_px;
  const int wanted_x = whole_x_ ? std::clamp(static_cast<int>(x_.high - x_.low), 1, 9) : 9;
  const double step_x = tick_step(x_.low, x_.high, wanted_x), step_y = tick_step(y_.low, y_.high, 6);
  const auto ticks = [](bool logarithmic, const Range& range, int wanted) {
    return logarithmic ? decades(range.low, range.high) : round_ticks(range.low, range.high, wanted);
  };
  const auto label = [](bool logarithmic, double value, double step) {
    return logarithmic ? decade_text(value) : tick_text(value, step);
  };
  for (const double x : ticks(labels.log_x, x_, wanted_x)) {
    const Eigen::Vector2f p = at(x, y_.low);
    line(p, at(x, y_.high), kGrid);
    const std::string text = label(labels.log_x, x, step_x);
    text_.draw(image_, static_cast<int>(p.x()) - text_.width_px(text) / 2, bottom + 5, text, kInk);
  }
  for (const double y : ticks(labels.log_y, y_, 6)) {
    const Eigen::Vector2f p = at(x_.low, y);
    line(p, at(x_.high, y), kGrid);
    const std::string text = label(labels.log_y, y, step_y);
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
    if (series.style == Series::Style::line) draw_polyline(image_, run, 1.8f, colour);
    for (std::size_t k = 1; k < run.size() && series.style == Series::Style::dashes; ++k)
      dash(run[k - 1], run[k], colour);
    for (std::size_t k = 0; k < run.size() && series.style == Series::Style::points; ++k) draw_dot(run[k], colour);
    run.clear();
  };
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (has_place(series.x[i], series.y[i]) && is_inside(series.x[i], series.y[i])) {
      run.push_back(at(scaled_x(series.x[i]), scaled_y(series.y[i])));
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
    fill(image_, {x - 20, y + text_.line_height_px() / 2 - 1, 22, 3}, colour_of(series, i));
    x -= 36;
  }
}

}  // namespace

Series front_of(const std::vector<Series>& series) {
  std::vector<std::pair<double, double>> all;
  for (const Series& s : series)
    for (std::size_t i = 0; i < s.x.size(); ++i)
      if (std::isfinite(s.x[i]) && std::isfinite(s.y[i])) all.emplace_back(s.x[i], s.y[i]);
  std::sort(all.begin(), all.end());
  Series front;
  front.name = "front";
  front.style = Series::Style::dashes;
  for (const auto& [x, y] : all) {
    if (!front.y.empty() && y >= front.y.back()) continue;
    front.x.push_back(x);
    front.y.push_back(y);
  }
  return front;
}

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

Image heat_map(const ChartLabels& labels, const HeatMap& map, const std::vector<Series>& series, int width_px,
               int height_px) {
  return Chart(labels, series, width_px, height_px, &map).take();
}

Image plot(const ChartLabels& labels, const std::vector<Series>& series, int width_px, int height_px) {
  return Chart(labels, series, width_px, height_px).take();
}

}  // namespace sectio
