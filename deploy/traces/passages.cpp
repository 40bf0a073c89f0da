#include "deploy/traces/passages.h"

#include <array>
#include <cmath>
#include <initializer_list>

#include "common/core/formatted.h"

namespace sectio {
namespace {

// The bar of bar_*.yaml: 20 mm wide and high, along x, its middle 60 mm above the floor.
// The kidney of kidney_section.yaml: on its side, its middle 50 mm above the floor, cut from pole to pole.
// The box of paper_box.yaml: 80 x 80 x 25 mm on the floor; the corner at (40, 40) mm is cut off.
constexpr double kWide_rad = 0.35;

// A stroke over the pad of skin_*.yaml, whose skin is at 10 mm: down at its first place, from one to the next at one
// speed, up at the last. At each corner the blade turns while it rests.
struct Line {
  std::vector<Vec3> tips_world_m;
  double speed_m_per_s = 0.03;
  bool rounded = false;  // it turns on its way
};

Line arc(const Vec3& middle_world_m, double radius_m, double from_deg, double to_deg) {
  constexpr int kPieces = 18;
  Line line{.tips_world_m = {}, .rounded = true};
  for (int i = 0; i <= kPieces; ++i) {
    const double at_rad = (from_deg + (to_deg - from_deg) * i / kPieces) * M_PI / 180;
    line.tips_world_m.push_back(middle_world_m + radius_m * Vec3(std::cos(at_rad), std::sin(at_rad), 0));
  }
  return line;
}

std::vector<Place> lines(std::initializer_list<Line> strokes) {
  constexpr double kAloft_m = 0.018, kClear_m = 0.026, kTurn_s = 0.2, kRest_s = 0.1;  // clear: of every body
  std::vector<Place> places;
  for (const Line& line : strokes) {
    const std::vector<Vec3>& tips = line.tips_world_m;
    const auto ahead_deg = [&](std::size_t i) {
      const Vec3 way = tips[i + 1] - tips[i];
      return std::atan2(way.y(), way.x()) * 180 / M_PI;
    };
    const auto above = [&](const Vec3& tip) { return Vec3(tip.x(), tip.y(), kAloft_m); };
    places.push_back({above(tips.front()), ahead_deg(0), 2 * kRest_s, 0.08});
    places.push_back({tips.front(), ahead_deg(0), kRest_s});
    for (std::size_t i = 1; i < tips.size(); ++i) {
      places.push_back({tips[i], ahead_deg(i - 1), 0, line.speed_m_per_s});
      if (!line.rounded && i + 1 < tips.size() && ahead_deg(i) != ahead_deg(i - 1))
        places.push_back({tips[i], ahead_deg(i), kTurn_s});
    }
    places.push_back({above(tips.back()), places.back().ahead_deg, kRest_s, 0.06});
  }
  places.front().tip_world_m.z() = places.back().tip_world_m.z() = kClear_m;
  return places;
}

// At each corner the blade turns about the place where it enters the skin, which is ahead of its tip.
std::vector<Place> corners() {
  constexpr double kTipBehind_m = 0.0028, kTurn_s = 0.2, kTurnBy_deg = 15, kDepth_m = 0.004, kClear_m = 0.026;
  const auto tip = [&](const Vec3& enters_m, double ahead_deg) {
    const double ahead_rad = ahead_deg * M_PI / 180;
    return Vec3(enters_m - kTipBehind_m * Vec3(std::cos(ahead_rad), std::sin(ahead_rad), 0));
  };
  const std::array<Vec3, 5> ends{Vec3(-0.026, 0.010, kDepth_m), Vec3(-0.006, 0.010, kDepth_m),
                                 Vec3(-0.006, -0.010, kDepth_m), Vec3(0.0113, 0, kDepth_m),
                                 Vec3(0.0113, -0.012, kDepth_m)};
  constexpr std::array<double, 4> kAhead_deg{0, -90, 30, -90};
  const auto clear = [&](const Vec3& x) { return Vec3(x.x(), x.y(), kClear_m); };
  const Vec3 first = tip(ends.front(), kAhead_deg.front()), last = tip(ends.back(), kAhead_deg.back());
  std::vector<Place> places{{clear(first), kAhead_deg[0], 0.2}, {first, kAhead_deg[0], 0.1}};
  for (std::size_t i = 0; i < kAhead_deg.size(); ++i) {
    places.push_back({tip(ends[i + 1], kAhead_deg[i]), kAhead_deg[i]});
    if (i + 1 == kAhead_deg.size()) break;
    const double turn_deg = kAhead_deg[i + 1] - kAhead_deg[i];
    const int pieces = static_cast<int>(std::abs(turn_deg) / kTurnBy_deg);
    const double chord_m = 2 * kTipBehind_m * std::sin(std::abs(turn_deg) / pieces * M_PI / 360);
    for (int k = 1; k <= pieces; ++k) {
      const double ahead_deg = kAhead_deg[i] + turn_deg * k / pieces;
      places.push_back({tip(ends[i + 1], ahead_deg), ahead_deg, 0, chord_m * pieces / kTurn_s});
    }
  }
  places.push_back({clear(last), kAhead_deg.back(), 0.1, 0.06});
  return places;
}

// A blade that turns late: past each corner it drags the tissue along on its flat side, until it faces its way.
std::vector<Place> zigzag() {
  constexpr double kLeg_m = 0.012, kSteep_deg = 60, kLate_m = 0.005, kTurned_m = 0.007;
  constexpr double kDepth_m = 0.004, kClear_m = 0.026, kSlow_m_per_s = 0.02;
  const auto at_height = [](const Vec3& x, double z_m) { return Vec3(x.x(), x.y(), z_m); };
  Vec3 corner(-0.024, -0.004, kDepth_m);
  double before_deg = kSteep_deg;
  std::vector<Place> places{{at_height(corner, kClear_m), before_deg, 0.2}, {corner, before_deg, 0.1}};
  for (const double ahead_deg : {kSteep_deg, -kSteep_deg, kSteep_deg, -kSteep_deg, kSteep_deg, -kSteep_deg}) {
    const double ahead_rad = ahead_deg * M_PI / 180;
    const Vec3 ahead(std::cos(ahead_rad), std::sin(ahead_rad), 0);
    if (ahead_deg != before_deg) places.push_back({corner + kLate_m * ahead, before_deg, 0, kSlow_m_per_s});
    places.push_back({corner + kTurned_m * ahead, ahead_deg, 0, kSlow_m_per_s});
    corner += kLeg_m * ahead;
    places.push_back({corner, ahead_deg, 0, kSlow_m_per_s});
    before_deg = ahead_deg;
  }
  places.push_back({at_height(corner, kClear_m), before_deg, 0.1, 0.06});
  return places;
}

// Two strokes across the bar of bar_wedge.yaml, whose upper side is at 10 mm. Their planes cross 3.6 mm above the tips.
std::vector<Place> wedge() {
  constexpr double kLean_deg = 40, kTip_m = -0.001, kBeside_m = 0.003, kMiddle_m = 0.004, kAway_m = 0.04;
  std::vector<Place> places;
  for (const double side : {1.0, -1.0}) {
    const double lean_rad = side * kLean_deg * M_PI / 180;
    const Vec3 out = kAway_m * Vec3(std::sin(lean_rad), 0, std::cos(lean_rad));
    const Vec3 begin(kMiddle_m - side * kBeside_m, -0.02, kTip_m), end(begin.x(), 0.02, kTip_m);
    const auto at = [&](const Vec3& tip, double speed_m_per_s) {
      return Place{.tip_world_m = tip, .ahead_deg = 90, .speed_m_per_s = speed_m_per_s, .lean_deg = side * kLean_deg};
    };
    places.push_back(at(begin + out, 0.2));
    places.push_back(at(begin, 0.1));
    places.push_back(at(end, 0.02));
    places.push_back(at(end + out, 0.1));
  }
  places.back().rest_s = 0.5;
  return places;
}

const auto kPassages = std::to_array<Passage>({
    {.name = "skin_corners", .places = corners()},
    {.name = "skin_depth",
     .places = lines({{.tips_world_m = {{-0.024, 0.001, 0.007},
                                        {-0.012, 0.001, 0.001},
                                        {0.000, 0.001, 0.007},
                                        {0.012, 0.001, 0.001},
                                        {0.024, 0.001, 0.007}}}})},
    {.name = "skin_head_on_left",
     .places = lines({{.tips_world_m = {{-0.026, 0.0000, 0.004}, {0.0005, 0.0002, 0.004}}}})},
    {.name = "skin_head_on_right",
     .places = lines({{.tips_world_m = {{0.026, 0.0004, 0.004}, {0.0005, 0.0002, 0.004}}}})},
    {.name = "skin_speeds",
     .places = lines({{.tips_world_m = {{-0.004, 0.014, 0.004}, {0.004, 0.014, 0.004}}, .speed_m_per_s = 0.0005},
                      {.tips_world_m = {{-0.025, -0.012, 0.004}, {0.025, -0.012, 0.004}}, .speed_m_per_s = 5}})},
    {.name = "skin_again",
     .places = lines({{.tips_world_m = {{-0.028, 0.001, 0.004}, {-0.014, 0.001, 0.004}}},
                      {.tips_world_m = {{-0.018, 0.001, 0.004}, {0.000, 0.001, 0.004}}},
                      {.tips_world_m = {{0.000, 0.001, 0.004}, {0.013, 0.001, 0.004}}},
                      {.tips_world_m = {{0.014, 0.001, 0.004}, {0.028, 0.001, 0.004}}}})},
    {.name = "skin_saw",
     .places = {{.tip_world_m = {-0.026, 0.001, 0.026}, .ahead_deg = 0, .rest_s = 0.2},
                {.tip_world_m = {-0.026, 0.001, 0.004}, .ahead_deg = 0, .rest_s = 0.1},
                {.tip_world_m = {-0.014, 0.001, 0.004}, .ahead_deg = 0},
                {.tip_world_m = {-0.019, 0.001, 0.004}, .ahead_deg = 0},
                {.tip_world_m = {-0.007, 0.001, 0.004}, .ahead_deg = 0, .rest_s = 0.3},
                {.tip_world_m = {-0.012, 0.001, 0.004}, .ahead_deg = 0},
                {.tip_world_m = {0.000, 0.001, 0.004}, .ahead_deg = 0},
                {.tip_world_m = {-0.005, 0.001, 0.004}, .ahead_deg = 0},
                {.tip_world_m = {0.007, 0.001, 0.004}, .ahead_deg = 0, .rest_s = 0.3},
                {.tip_world_m = {0.002, 0.001, 0.004}, .ahead_deg = 0},
                {.tip_world_m = {0.014, 0.001, 0.004}, .ahead_deg = 0},
                {.tip_world_m = {0.014, 0.001, 0.026}, .ahead_deg = 0, .rest_s = 0.1, .speed_m_per_s = 0.06}}},
    {.name = "skin_zigzag", .places = zigzag()},
    {.name = "skin_rings",  // arcs that overlap by 3 mm; that end where the other begins; 0.6 mm before it
     .places = lines({arc({-0.03, 0, 0.004}, 0.009, 0, 190), arc({-0.03, 0, 0.004}, 0.009, 170, 370),
                      arc({0, 0, 0.004}, 0.009, 0, 180), arc({0, 0, 0.004}, 0.009, 180, 360),
                      arc({0.03, 0, 0.004}, 0.009, 0, 178), arc({0.03, 0, 0.004}, 0.009, 182, 358)})},
    {.name = "skin_moon",  // the second arc begins beside the rim of the first one's hole, and ends in the hole
     .places = lines({arc({0.004, 0, 0.004}, 0.008, 0, 375), arc({-0.006, 0, 0.004}, 0.0085, 53, 318)})},
    {.name = "templates_depth",
     .places = lines({{.tips_world_m = {{-0.024, 0.001, 0.008},
                                        {-0.012, 0.001, 0.002},
                                        {0.000, 0.001, 0.008},
                                        {0.012, 0.001, 0.002},
                                        {0.024, 0.001, 0.008}}}})},
    {.name = "bar_one_sequence",
     .places = {{.tip_world_m = {0.0043, -0.026, 0.045}, .ahead_deg = 90, .rest_s = 0.3},
                {.tip_world_m = {0.0047, -0.001, 0.045}, .ahead_deg = 90, .rest_s = 0.4},
                {.tip_world_m = {0.0052, 0.026, 0.045}, .ahead_deg = 90, .rest_s = 1.5}}},
    {.name = "bar_wedge", .places = wedge()},
    {.name = "bar_corners",  // in from a side, along the bar, and out again
     .places =
         lines({{.tips_world_m =
                     {{0.040, 0.022, -0.014}, {0.040, -0.002, -0.014}, {0.018, -0.002, -0.014}, {0.018, 0.022, -0.014}},
                 .speed_m_per_s = 0.02}})},
    {.name = "bar_two_sequences",
     .places = {{.tip_world_m = {0.0042, -0.026, 0.045}, .ahead_deg = 90, .rest_s = 0.3},
                {.tip_world_m = {0.0046, 0.0012, 0.045}, .ahead_deg = 90, .rest_s = 0.2},
                {.tip_world_m = {0.0042, -0.026, 0.045}, .ahead_deg = 90},
                {.tip_world_m = {-0.0044, -0.026, 0.090}, .ahead_deg = 90, .speed_m_per_s = 0.1},
                {.tip_world_m = {0.0051, 0.026, 0.090}, .ahead_deg = 270, .speed_m_per_s = 0.1},
                {.tip_world_m = {0.0051, 0.026, 0.044}, .ahead_deg = 270, .rest_s = 0.2, .speed_m_per_s = 0.1},
                {.tip_world_m = {0.0043, -0.030, 0.044}, .ahead_deg = 270, .rest_s = 1.5}}},
    {.name = "kidney_section",
     .places = {{.tip_world_m = {-0.066, -0.0012, 0.012}, .ahead_deg = 0, .rest_s = 0.3},
                {.tip_world_m = {0.066, -0.0012, 0.012}, .ahead_deg = 0},
                {.tip_world_m = {0.160, -0.0012, 0.090}, .ahead_deg = 0, .rest_s = 1.2, .speed_m_per_s = 0.12}}},
    {.name = "skin_rim",  // right across the bar; from its middle over a rim; over a rim to its middle
     .places = {{.tip_world_m = {0.001, -0.020, 0.030}, .ahead_deg = 90, .rest_s = 0.3},
                {.tip_world_m = {0.001, -0.020, 0.005}, .ahead_deg = 90, .rest_s = 0.1},
                {.tip_world_m = {0.001, 0.022, 0.005}, .ahead_deg = 90, .rest_s = 0.1},
                {.tip_world_m = {0.001, 0.022, 0.030}, .ahead_deg = 90},
                {.tip_world_m = {0.026, -0.002, 0.030}, .ahead_deg = 90, .rest_s = 0.2, .speed_m_per_s = 0.06},
                {.tip_world_m = {0.026, -0.002, 0.005}, .ahead_deg = 90},
                {.tip_world_m = {0.026, 0.022, 0.005}, .ahead_deg = 90, .rest_s = 0.1},
                {.tip_world_m = {0.026, 0.022, 0.030}, .ahead_deg = 90},
                {.tip_world_m = {-0.024, -0.020, 0.030}, .ahead_deg = 90, .rest_s = 0.2, .speed_m_per_s = 0.06},
                {.tip_world_m = {-0.024, -0.020, 0.005}, .ahead_deg = 90, .rest_s = 0.1},
                {.tip_world_m = {-0.024, 0.002, 0.005}, .ahead_deg = 90, .rest_s = 0.2},
                {.tip_world_m = {-0.024, 0.002, 0.030}, .ahead_deg = 90, .rest_s = 0.8}}},
    {.name = "exercise_vessel",
     .places = {{.tip_world_m = {0.0, -0.016, 0.055}, .ahead_deg = 90, .rest_s = 0.4},
                {.tip_world_m = {0.0, -0.016, 0.021}, .ahead_deg = 90, .rest_s = 0.2, .speed_m_per_s = 0.03},
                {.tip_world_m = {0.0, 0.012, 0.021}, .ahead_deg = 90, .rest_s = 0.3, .speed_m_per_s = 0.01},
                {.tip_world_m = {0.0, 0.012, 0.070}, .ahead_deg = 90, .rest_s = 0.6, .speed_m_per_s = 0.06}}},
    {.name = "paper_box_knife",
     .places = {{.tip_world_m = {0.052, -0.002, 0.060}, .ahead_deg = 135, .rest_s = 1.6},
                {.tip_world_m = {0.052, -0.002, -0.004}, .ahead_deg = 135, .rest_s = 0.2, .speed_m_per_s = 0.1},
                {.tip_world_m = {-0.006, 0.056, -0.004}, .ahead_deg = 135, .rest_s = 0.1},
                {.tip_world_m = {-0.006, 0.056, 0.060}, .ahead_deg = 135, .rest_s = 3, .speed_m_per_s = 0.1}}},
    {.name = "tumour_pole_knife",
     .places = {{.tip_world_m = {0.033, -0.040, 0.060}, .ahead_deg = 90, .rest_s = 2.6},
                {.tip_world_m = {0.033, -0.040, -0.027}, .ahead_deg = 90, .rest_s = 0.1, .speed_m_per_s = 0.2},
                {.tip_world_m = {0.033, 0.040, -0.027}, .ahead_deg = 90, .rest_s = 0.1},
                {.tip_world_m = {0.033, 0.040, 0.060}, .ahead_deg = 90, .rest_s = 1, .speed_m_per_s = 0.2},
                {.tip_world_m = {-0.020, 0.080, 0.080}, .ahead_deg = 90, .rest_s = 1, .speed_m_per_s = 0.1}}},
    {.name = "paper_box_corner",  // takes the corner, lifts it a little, and carries it away once it is off
     .places = {{.tip_world_m = {0.033, 0.033, 0.060}, .ahead_deg = 45, .opening_rad = kWide_rad},
                {.tip_world_m = {0.033, 0.033, 0.024}, .ahead_deg = 45, .rest_s = 0.1, .opening_rad = kWide_rad},
                {.tip_world_m = {0.033, 0.033, 0.024}, .ahead_deg = 45, .rest_s = 0.3},
                {.tip_world_m = {0.034, 0.034, 0.026}, .ahead_deg = 45, .rest_s = 4.0},
                {.tip_world_m = {0.050, 0.050, 0.050}, .ahead_deg = 45, .rest_s = 0.5},
                {.tip_world_m = {0.060, 0.060, 0.028}, .ahead_deg = 45, .rest_s = 0.2},
                {.tip_world_m = {0.060, 0.060, 0.028}, .ahead_deg = 45, .rest_s = 0.3, .opening_rad = kWide_rad},
                {.tip_world_m = {0.060, 0.060, 0.080}, .ahead_deg = 45, .rest_s = 1, .opening_rad = kWide_rad}},
     .has_jaws = true},
    {.name = "paper_box_hold",  // holds the other side down
     .places = {{.tip_world_m = {-0.025, -0.025, 0.060}, .ahead_deg = 225, .opening_rad = kWide_rad},
                {.tip_world_m = {-0.025, -0.025, 0.024}, .ahead_deg = 225, .rest_s = 0.1, .opening_rad = kWide_rad},
                {.tip_world_m = {-0.025, -0.025, 0.024}, .ahead_deg = 225, .rest_s = 0.3}},
     .has_jaws = true},
});

}  // namespace

std::span<const Passage> passages() {
  return kPassages;
}

std::string trace_of(const Passage& passage) {
  std::string text = "time_s,x_world_m,y_world_m,z_world_m,qw,qx,qy,qz";
  text += passage.has_jaws ? ",opening_rad\n" : "\n";
  double time_s = 0;
  const auto add = [&](const Place& at) {
    const double half_rad = at.ahead_deg * M_PI / 360, half_lean_rad = at.lean_deg * M_PI / 360;
    const double c = std::cos(half_rad), s = std::sin(half_rad);
    const double lean = std::sin(half_lean_rad), up = std::cos(half_lean_rad);
    text += formatted("%.3f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f", time_s, at.tip_world_m.x(), at.tip_world_m.y(),
                      at.tip_world_m.z(), up * c, lean * c + 0.0, lean * s + 0.0, up * s);  // never -0
    if (passage.has_jaws) text += formatted(",%.6f", at.opening_rad);
    text += "\n";
  };
  for (std::size_t i = 0; i < passage.places.size(); ++i) {
    const Place& to = passage.places[i];
    const double way_m = i > 0 ? (to.tip_world_m - passage.places[i - 1].tip_world_m).norm() : 0;
    if (way_m > 0) time_s += way_m / to.speed_m_per_s;
    if (i == 0 || way_m > 0) add(to);
    if (to.rest_s == 0) continue;
    time_s += to.rest_s;
    add(to);
  }
  return text;
}

}  // namespace sectio
