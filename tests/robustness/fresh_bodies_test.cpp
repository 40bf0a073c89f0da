// Organs, tissues and strokes that no shipped scene has.
#include <cmath>
#include <numbers>
#include <sstream>

#include "tests/robustness/fresh_scenes.h"

namespace sectio::test {
namespace {

constexpr double kAbove_m = 0.012, kDown_s = 0.3;
constexpr int kPointsAStroke = 120;
using Vec2 = Eigen::Vector2d;
constexpr double kTurn = 2 * std::numbers::pi;

// |x/a|^e + |y/b|^e + |z/c|^e = 1, from a ball (e = 2) to nearly a box, with three waves over it.
class Lump {
 public:
  explicit Lump(Numbers& numbers)
      : half_axes_m(numbers.between(0.035, 0.08), numbers.between(0.03, 0.06), numbers.between(0.022, 0.04)),
        power_(numbers.one_of(std::array{2.0, 2.0, 3.0, 5.0})) {
    for (Wave& w : waves_) {
      for (int k = 0; k < 3; ++k) w.along[k] = numbers.between(-1, 1);
      w.count = numbers.between(2, 6), w.height = numbers.between(-0.04, 0.04), w.phase = numbers.between(0, kTurn);
    }
  }

  double radius_m(const Vec3& way) const {
    double sum = 0, waves = 1;
    for (int k = 0; k < 3; ++k) sum += std::pow(std::abs(way[k] / half_axes_m[k]), power_);
    for (const Wave& w : waves_) waves += w.height * std::sin(w.count * way.dot(w.along) + w.phase);
    return waves * std::pow(sum, -1 / power_);
  }
  Vec3 top_m(const Vec2& at) const {
    double low_m = 0, high_m = 0.12;
    for (int k = 0; k < 50; ++k) {
      const Vec3 x(at.x(), at.y(), 0.5 * (low_m + high_m));
      (x.norm() < radius_m(x.normalized()) ? low_m : high_m) = x.z();
    }
    return {at.x(), at.y(), low_m};
  }
  Vec3 normal(const Vec2& at) const {
    const Vec2 x(2e-3, 0), y(0, 2e-3);
    return (top_m(at + x) - top_m(at - x)).cross(top_m(at + y) - top_m(at - y)).normalized();
  }
  TriangleSoup mesh(int levels) const {
    TriangleSoup soup = ellipsoid(levels, Vec3::Ones());
    for (Vec3& x : soup.vertices_body_m) x = radius_m(x.normalized()) * x.normalized();
    return soup;
  }

  const Vec3 half_axes_m;

 private:
  struct Wave {
    Vec3 along;
    double count, height, phase;
  };
  double power_;
  std::array<Wave, 3> waves_;
};

using Way = std::vector<Vec2>;  // seen from above

// Comes down, goes along the way as deep as it can be held there, and comes up. Returns the length of the way.
double add_stroke(std::vector<TracePoint>& trace, const Lump& lump, const Way& way, double depth_m,
                  double speed_m_per_s, double lean) {
  const auto pose = [&](std::size_t k, double above_m) {
    const Vec3 up = lump.normal(way[k]);
    const Vec2 on = way[std::min(k + 1, way.size() - 1)] - way[k > 0 ? k - 1 : 0];
    Vec3 ahead(on.x(), on.y(), 0);
    ahead = (ahead - ahead.dot(up) * up).normalized();
    const Vec3 shaft = (up + lean * up.cross(ahead)).normalized();
    return held(lump.top_m(way[k]) + above_m * up, shaft, ahead);
  };
  double time_s = trace.empty() ? 0.1 : trace.back().time_s + 0.1, length_m = 0;
  const std::size_t last = way.size() - 1;
  for (int k = 0; k <= 40; ++k)
    trace.push_back({time_s + kDown_s * k / 40, pose(0, kAbove_m - (kAbove_m + depth_m) * k / 40), 0});
  for (std::size_t k = 1; k <= last; ++k) {
    const double piece_m = (lump.top_m(way[k]) - lump.top_m(way[k - 1])).norm();
    length_m += piece_m;
    trace.push_back({trace.back().time_s + piece_m / speed_m_per_s, pose(k, -depth_m), 0});
  }
  time_s = trace.back().time_s + 0.2;
  for (int k = 0; k <= 40; ++k)
    trace.push_back({time_s + kDown_s * k / 40, pose(last, -depth_m + (kAbove_m + depth_m) * k / 40), 0});
  return length_m;
}

double volume_m3(const TriangleSoup& soup) {
  double sum = 0;
  for (const auto& [a, b, c] : soup.triangles)
    sum += soup.vertices_body_m[a].cross(soup.vertices_body_m[b]).dot(soup.vertices_body_m[c]) / 6;
  return sum;
}

enum class Tissue : std::uint8_t { skin, skin_by_templates, volume };

// How a body of the tissue deforms and is cut, as lines of a scene.
std::string model(Tissue tissue, int tetrahedra, bool whole, Numbers& numbers) {
  const double young_pa = std::pow(10, numbers.between(3.5, 4.5));
  std::ostringstream lines;
  if (tissue != Tissue::volume) {
    lines << "    cutting: {threshold_displacement_m: 0.001"
          << (tissue == Tissue::skin_by_templates ? ", style: templates" : "") << "}\n"
          << "    material: {poisson: 0.45, density_kg_per_m3: 1050, foundation_radius_m: 0.03, damping_per_s: 30, "
             "young_pa: "
          << young_pa << ", pretension: " << numbers.between(0.03, 0.3) << "}\n";
    return lines.str();
  }
  const std::string kind = whole ? numbers.one_of(std::array{"neo_hookean", "tetra_springs"})
                                 : numbers.one_of(std::array{"neo_hookean", "tetra_springs", "neo_hookean_lattice"});
  lines << "    model: " << kind << "\n    volume: {mesher: lattice, tetrahedra: " << tetrahedra
        << ", least_part_s: 0.0001}\n    cutting: {threshold_force_n: 0.03, style: "
        << (whole ? "semi_progressive" : "progressive") << "}\n"
        << "    material: {" << (kind == "tetra_springs" ? "" : "poisson: 0.42, ")
        << "density_kg_per_m3: 1050, damping_per_s: 30, young_pa: " << 2 * young_pa << "}\n";
  return lines.str();
}

// Leaves a mesh, a trace and a scene in the directory. Returns a line for a person.
std::string make_scene(std::uint64_t seed, Tissue tissue, const std::string& directory) {
  Numbers numbers(seed);
  const bool is_volume = tissue == Tissue::volume;
  const Lump lump(numbers);
  const int levels = numbers.one_of(std::array{4, 5, 5});
  const char* kind = numbers.one_of(std::array{"line", "wave", "corner", "ring", "cross", "tee"});
  if (tissue == Tissue::skin_by_templates) kind = numbers.one_of(std::array{"line", "wave"});
  if (is_volume) kind = numbers.one_of(std::array{"line", "wave", "corner", "cross"});
  const double room_m = 0.6 * std::min(lump.half_axes_m.x(), lump.half_axes_m.y());
  const Vec2 middle(numbers.between(-0.15, 0.15) * room_m, numbers.between(-0.15, 0.15) * room_m);
  const double heading = numbers.between(0, kTurn),
               length_m = (is_volume ? 1.5 : 1) * numbers.between(0.6, 1.2) * room_m;
  const auto along = [&](auto&& place) {
    Way way;
    for (int k = 0; k <= kPointsAStroke; ++k)
      way.push_back(middle + Eigen::Rotation2Dd(heading) * Vec2(place(double(k) / kPointsAStroke)));
    return way;
  };
  const auto line = [&](const Vec2& from, const Vec2& to) {
    return along([&](double s) { return from + s * (to - from); });
  };
  const Vec2 half(length_m / 2, 0), across(0, length_m / 2);
  const std::string name = kind;
  std::vector<Way> ways;
  std::string expect = "pieces_freed: 0";
  if (name == "line") ways = {line(-half, half)};
  if (name == "wave")
    ways = {along([&](double s) { return Vec2((s - 0.5) * length_m, 0.12 * length_m * std::sin(kTurn * s)); })};
  if (name == "corner") {
    const Eigen::Rotation2Dd turn(numbers.between(0.5, 1.8));
    ways = {line(-half, {0, 0})};
    const Way on = line({0, 0}, turn * half);
    ways[0].insert(ways[0].end(), on.begin() + 1, on.end());
  }
  if (name == "ring") {
    const double radius_m = 0.4 * length_m, narrow = numbers.between(0.7, 1);
    const double angle = kTurn + numbers.between(0.001, 0.004) / radius_m;
    ways = {
        along([&](double s) { return Vec2(radius_m * std::cos(angle * s), narrow * radius_m * std::sin(angle * s)); })};
    expect = "pieces_freed: 1";
  }
  if (name == "cross") {
    const Eigen::Rotation2Dd turn(numbers.between(0.6, 1.57));
    ways = {line(-half, half), line(turn * -half, turn * half)};
  }
  if (name == "tee") ways = {line(-half, half), line(-across, {0, numbers.between(-0.001, 0.001)})};
  expect += ways.size() > 1 && !is_volume ? ", joins: at least 1" : ", incisions: 1";

  const TriangleSoup soup = lump.mesh(levels);
  // Regular tetrahedra with this edge fill the body.
  const double edge_m = length_m / numbers.between(4, 8);
  const int tetrahedra = std::clamp(static_cast<int>(volume_m3(soup) / (edge_m * edge_m * edge_m / 8.5)), 1000, 12000);
  // A shallow blade goes through no whole tetrahedron.
  const bool whole = is_volume && numbers.between(0, 1) < 0.4;
  const double depth_m = is_volume ? edge_m * numbers.between(whole ? 2 : 1.2, 3) : numbers.between(0.0025, 0.006),
               lean = numbers.between(-0.25, 0.25);
  const double speed_m_per_s = std::pow(10, numbers.between(-2, -1));
  std::vector<TracePoint> trace;
  double sum_m = 0;
  for (const Way& way : ways) sum_m += add_stroke(trace, lump, way, depth_m, speed_m_per_s, lean);
  // The blade leans, and the tissue gives way.
  const double near_m = is_volume ? edge_m * static_cast<double>(ways.size()) : 0;
  expect += ", cut_m: " + std::to_string(0.9 * sum_m - near_m - 0.002) + " to " +
            std::to_string(1.25 * sum_m + near_m + 0.003);

  leave_files(directory, soup, trace);
  std::ofstream scene(directory + "/scene.yaml");
  const std::string deforms = model(tissue, tetrahedra, whole, numbers);
  scene << "session: fresh_" << seed << "\nstep_s: auto\nduration_s: " << trace.back().time_s + 0.8 << "\nexpect: {"
        << expect << R"(}
camera: {eye_world_m: [0.02, -0.12, 0.16], target_world_m: [0, 0, 0.02], field_of_view_deg: 32}
bodies:
  - name: body
    mesh: {file: body.obj, unit: m}
)" << deforms
        << R"(    fixed: {min_world_m: [-1, -1, -1], max_world_m: [1, 1, )" << -0.35 * lump.half_axes_m.z() << R"(]}
tools:
)"
        << (is_volume ? "  - {name: knife, kind: knife, trace: hand.csv, geometry: {a_tool_m: [0, 0, 0], b_tool_m: "
                        "[0, 0, 0.06], c_tool_m: [0.002, 0, 0.04], d_tool_m: [0.002, 0, 0.06], sharp_length_m: 0.04}}\n"
                      : "  - {name: scalpel, kind: scalpel, trace: hand.csv}\n");
  std::ostringstream words;
  words << name << ", " << soup.triangles.size() << " triangles, " << 1e3 * sum_m << " mm long, " << 1e3 * depth_m
        << " mm deep, " << 1e3 * speed_m_per_s << " mm/s\n"
        << deforms;
  return words.str();
}

void play_bodies(Tissue tissue) {
  play([&](std::uint64_t seed, const std::string& directory) { return make_scene(seed, tissue, directory); });
}

TEST(FreshBodies, are_cut_as_their_strokes_say) {
  play_bodies(Tissue::skin);
}
TEST(FreshBodies, are_cut_by_templates) {
  play_bodies(Tissue::skin_by_templates);
}
TEST(FreshBodies, are_cut_through_their_volume) {
  play_bodies(Tissue::volume);
}

}  // namespace
}  // namespace sectio::test
