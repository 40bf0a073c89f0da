#include "tests/feel/blade_work.h"

#include <algorithm>
#include <cmath>

#include "sim_server/prepare/prepare.h"
#include "sim_server/simulation.h"
#include "tests/support/shapes.h"

namespace sectio::test {
namespace {

constexpr double kAbove_m = 0.002, kAside_m = 0.005;
constexpr double kEnds_m = 0.004;  // ends of a steady leg in tissue: the force rises, and falls

Scene scene_of(const BladeTissue& tissue, const BladeStroke& stroke) {
  Scene scene = felt_block(tissue.model, 6e3, stroke.tool);
  BodySpec& body = scene.bodies[0];
  body.mesh = box(6 * tissue.squares, 4 * tissue.squares, 3 * tissue.squares, Vec3(0.06, 0.04, kBlockTop_m));
  body.cutting.style = tissue.style;
  body.cutting.threshold_force_n = 0.03;
  body.material.toughness_j_per_m2 = tissue.toughness_j_per_m2;
  if (tissue.tetrahedra > 0) body.volume.tetrahedra = tissue.tetrahedra;
  if (tissue.cell_m > 0) body.volume.cell_m = tissue.cell_m;
  scene.tools[0].geometry = stroke.geometry;
  return scene;
}

ToolGeometry knife() {
  ToolGeometry g;
  g.a_tool_m = Vec3::Zero(), g.b_tool_m = Vec3(-0.01, 0, 0.05);
  g.c_tool_m = Vec3(0.001, 0, 0.05), g.d_tool_m = Vec3(-0.005, 0, 0.052);
  g.sharp_length_m = 0.045;
  return g;
}

class BladeHand {
 public:
  BladeHand(const Scene& scene, const Vec3& from_m) : scene_(prepared(scene)), simulation_(scene_), at_m_(from_m) {}

  LegWork go(const BladeLeg& leg, double speed_m_per_s) {
    const Vec3 from_m = at_m_;
    const auto steps = std::max(1, static_cast<int>(std::lround(leg.by_m.norm() / speed_m_per_s / scene_.step_s)));
    const double ends = (leg.outside_m + kEnds_m) / leg.by_m.norm();
    LegWork done{leg};
    const double booked_j = booked_j_;
    double n = 0, sum = 0, squares = 0;
    for (int i = 1; i <= steps; ++i) {
      const double share = static_cast<double>(i) / steps;
      done.work_j += step(from_m + share * leg.by_m);
      if (leg.is_steady && (share < ends || share > 1 - ends)) continue;
      const double size_n = force_n_.norm();
      n += 1, sum += size_n, squares += size_n * size_n;
    }
    done.mean_n = n > 0 ? sum / n : 0;
    done.ripple_n = n > 0 ? std::sqrt(std::max(0.0, squares / n - done.mean_n * done.mean_n)) : 0;
    done.booked_j = booked_j_ - booked_j;
    done.last_n = force_n_;
    return done;
  }

  // The hand's work in a step.
  double step(const Vec3& to_m) {
    StepInput input;
    input.samples.push_back(
        {0, ++steps_, static_cast<double>(steps_) * scene_.step_s, {to_m, Eigen::Quaterniond::Identity()}});
    const StepOutput& out = simulation_.step(input);
    const Vec3 before_n = force_n_;
    force_n_ = out.contacts.at(0).force_world_n;
    booked_j_ = out.report.instrument_work_j;
    const Vec3 way_m = to_m - at_m_;
    at_m_ = to_m;
    return -0.5 * (before_n + force_n_).dot(way_m);
  }

 private:
  Scene scene_;
  Simulation simulation_;
  Vec3 at_m_, force_n_ = Vec3::Zero();
  double booked_j_ = 0;
  std::uint64_t steps_ = 0;
};

}  // namespace

// The edge of a scalpel leans forward by half of what it rises.
BladeStroke slide_and_return(double deep_m, double long_m) {
  BladeStroke stroke{"slide", "scalpel", {}, Vec3(-0.6 * long_m, 0.0017, kBlockTop_m + kAbove_m), {}};
  const Vec3 down(0, 0, -deep_m - kAbove_m), along(long_m, 0, 0);
  const double back = 0.7;
  stroke.legs = {{"down", down, 0.25 * deep_m * deep_m},
                 {"along", along, long_m * deep_m, true},
                 {"back", -back * along},
                 {"forth", back * along},
                 {"out", -down},
                 {"in", down},
                 {"out", -down}};
  return stroke;
}

BladeStroke plunge(double deep_m) {
  const Vec3 down(0, 0, -deep_m - kAbove_m);
  return {"plunge",
          "scalpel",
          {},
          Vec3(-0.004, 0.0017, kBlockTop_m + kAbove_m),
          {{"down", down, 0.25 * deep_m * deep_m}, {"out", -down}}};
}

BladeStroke right_through() {
  const Vec3 along(0.06 + 4 * kAside_m, 0, 0);
  return {"through",
          "knife",
          knife(),
          Vec3(-0.03 - 2 * kAside_m, 0.0017, -0.005),
          {{"through", along, 0.06 * kBlockTop_m, true, 2 * kAside_m + kEnds_m}}};
}

BladeStroke put_back() {
  const double half_m = 0.03, back_m = 0.006, beside_m = 0.0003;
  const Vec3 in(half_m + 2 * kAside_m, 0, 0), up(0, 0, kBlockTop_m + 2 * kAside_m);
  const double half_m2 = half_m * kBlockTop_m;
  return {"put back",
          "knife",
          knife(),
          right_through().from_m,
          {{"in", in, half_m2},
           {"out", up},
           {"back", Vec3(-back_m, beside_m, 0)},
           {"down", -up},
           {"on", in + Vec3(back_m, 0, 0), half_m2, true, back_m + 2 * kAside_m}}};
}

Vec3 edge_of_knife() {
  return (knife().c_tool_m - knife().a_tool_m).normalized();
}

BladeStroke slice(double slice_over_push) {
  const Vec3 edge = edge_of_knife(), ahead = Vec3::UnitY().cross(edge);
  return {"slice",
          "knife",
          knife(),
          Vec3(-0.03 - kAside_m, 0.0017, -0.001),
          {{"in", Vec3(kAside_m + 0.02, 0, 0)}, {"slice", 0.006 * (ahead - slice_over_push * edge)}}};
}

std::vector<LegWork> work_of(const BladeTissue& tissue, const BladeStroke& stroke, double speed_m_per_s) {
  BladeHand hand(scene_of(tissue, stroke), stroke.from_m);
  hand.step(stroke.from_m);
  std::vector<LegWork> done;
  for (const BladeLeg& leg : stroke.legs) done.push_back(hand.go(leg, speed_m_per_s));
  return done;
}

}  // namespace sectio::test
