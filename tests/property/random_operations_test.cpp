// In the whole simulation, a hand may do anything with any instrument: the surface stays closed, nothing of the body is
// lost, and no energy comes from nowhere.
#include <gtest/gtest.h>

#include <random>

#include "common/mesh/check.h"
#include "tests/support/operation.h"
#include "tests/support/random.h"
#include "tests/support/stroke_shapes.h"

namespace sectio::test {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr int kOperations = 4;
#else
constexpr int kOperations = 20;
#endif

struct OperatedBody {
  const char* name;
  TriangleSoup mesh;
  double top_m;  // the highest point
};
std::vector<OperatedBody> bodies() {
  return {{"organ", ellipsoid(3, Vec3(0.06, 0.06, 0.03)), 0.03},
          {"box", box(12, 10, 4, Vec3(0.10, 0.08, 0.03)), 0.03},
          {"ring", torus(28, 12, 0.045, 0.018), 0.018}};
}

Scene scene_of(const OperatedBody& body, const std::string& kind, const char* style) {
  Scene scene = organ_scene();
  scene.bodies[0].name = body.name;
  scene.bodies[0].mesh = body.mesh;
  scene.bodies[0].cutting.style = style;
  scene.tools[0].kind = kind;
  scene.tools[0].geometry = instrument_of(kind).geometry;
  return scene;
}

// Moves, turns and closes at random, mostly near the surface; sometimes it jumps, sometimes it stays in.
class Hand {
 public:
  Hand(Operation& op, const OperatedBody& body, std::uint64_t seed) : op_(op), body_(body), random_(seed) {
    at_ = {0, 0, body.top_m + 0.03};
    feed();
  }

  void operate() {
    const Box3 box = box_of_mesh();
    const Vec3 middle = box.center(), half = box.sizes() / 2;
    const Vec3 axis = Vec3(0.3 * u(), 0.3 * u(), 1).normalized();
    orientation_ = Eigen::AngleAxisd(M_PI * u(), axis);
    const Vec3 over = middle + Vec3(0.9 * half.x() * u(), 0.9 * half.y() * u(), half.z() + 0.01);
    opening_ = 0.3 + 0.2 * u();
    if (u() > 0) at_ = over;  // a jump
    go(over, opening_, 30);
    const double depth_m = 0.010 + 0.004 + 0.008 * std::abs(u());
    go(over - Vec3(0, 0, depth_m), opening_, 40);
    const Vec3 ahead = orientation_ * Vec3(1, 0.4 * u(), 0);
    for (int i = 0; i < 3; ++i) {
      const Vec3 drawn = at_ + 0.012 * (u() > -0.7 ? 1.0 : -1.0) * ahead + 0.003 * Vec3(u(), u(), u());
      go(drawn, u() > 0 ? 0.05 : 0.4, 60);
    }
    if (u() > -0.6) go(at_ + Vec3(0, 0, 0.03), 0.4, 20);
  }

 private:
  double u() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  Box3 box_of_mesh() const {
    Box3 box;
    for (const Vec3& p : body_.mesh.vertices_body_m) box.extend(p);
    return box;
  }
  void go(const Vec3& to, double opening_rad, int samples) {
    const Vec3 from = at_;
    const double opening_from = opening_;
    for (int i = 1; i <= samples; ++i) {
      at_ = from + (to - from) * i / samples;
      opening_ = opening_from + (opening_rad - opening_from) * i / samples;
      feed();
    }
  }
  void feed() {
    StepInput input;
    input.samples.push_back(op_.sample(0, {at_, orientation_}));
    input.samples.back().opening_rad = opening_;
    const StepOutput& out = op_.step(input);
    ASSERT_TRUE(out.contacts[0].force_world_n.allFinite());
  }

  Operation& op_;
  const OperatedBody& body_;
  test::Random64 random_;
  Vec3 at_;
  Eigen::Quaterniond orientation_ = Eigen::Quaterniond::Identity();
  double opening_ = 0.4;
};

class RandomOperations : public testing::TestWithParam<std::tuple<std::string, const char*, std::uint64_t>> {};
INSTANTIATE_TEST_SUITE_P(Every, RandomOperations,
                         testing::Combine(testing::ValuesIn(instrument_kinds()),
                                          testing::Values("progressive", "templates"), testing::Values(7, 100)),
                         [](const auto& p) {
                           return std::get<0>(p.param) + "_" + std::get<1>(p.param) + "_" +
                                  std::to_string(std::get<2>(p.param));
                         });

TEST_P(RandomOperations, leave_a_whole_body) {
  const auto& [kind, style, seed] = GetParam();
  for (const OperatedBody& body : bodies()) {
    SCOPED_TRACE(body.name);
    Operation op(scene_of(body, kind, style));
    const double volume_m3 = check(op.mesh()).volume_m3, energy_j = op.simulation.energy_j();
    VolumeAccount account(op.mesh());
    op.after_each = [&](const StepOutput& out) {
      const auto crumbs = std::ranges::count(out.events, EventKind::fragment_removed, &Event::kind);
      ASSERT_LE(out.deltas.size(), 1u + static_cast<std::size_t>(crumbs)) << "one body, one delta, and one a crumb";
      TopologyDelta all;
      for (const BodyDelta& d : out.deltas) {
        all.vertices.insert(all.vertices.end(), d.delta.vertices.begin(), d.delta.vertices.end());
        all.triangles.insert(all.triangles.end(), d.delta.triangles.begin(), d.delta.triangles.end());
      }
      account.add(all, op.mesh());
    };
    Hand hand(op, body, seed);
    for (int i = 0; i < kOperations; ++i) {
      ASSERT_NO_FATAL_FAILURE(hand.operate()) << i;
      ASSERT_NO_FATAL_FAILURE(op.expect_valid()) << i;
      // New vertices of skin get homes of their own, whose pull balances that of their springs: it moves nothing, but
      // is counted.
      EXPECT_LT(op.simulation.energy_j(), 1.05 * energy_j + op.last.report.instrument_work_j) << i;
    }
    const double change = (check(op.mesh()).volume_m3 + op.last.report.removed_volume_m3) / volume_m3 - 1;
    if (std::string(style) == "progressive") {
      EXPECT_NEAR(change, 0, 5e-5) << "lips that touch take nothing away, slivers that are mended next to nothing";
    } else {
      // Grooves take away; where a slit crosses a convex edge of a coarse mesh, its pair of points stands beside the
      // edge and so just outside of it.
      EXPECT_TRUE(change < 1e-5 && change > -0.02) << change;
    }
    EXPECT_NEAR(check(op.mesh()).volume_m3 + account.removed_m3(), volume_m3, 1e-9 * volume_m3);
    EXPECT_EQ(op.last.report.cuts_made > 0, kind != "probe" && kind != "forceps");
    EXPECT_LT(op.last.report.cuts_refused, std::uint64_t{kOperations}) << "refusals are for the exception";
    EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
  }
}

}  // namespace
}  // namespace sectio::test
