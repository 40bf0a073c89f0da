// Paper A, section 2.3: cuts as sequences of smaller ones (figures 6 and 7), and every way in which templates can meet.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "common/mesh/check.h"
#include "tests/support/blades_on_mesh.h"
#include "tests/support/knife_on_mesh.h"
#include "tests/support/stroke_shapes.h"

namespace sectio::test {
namespace {

constexpr double kDepth_m = 0.006;

// The planes p1 ... p4 of figure 6, one after another or as one; between two of them `rest` may do something else.
template <class Rest>
void cut_planes(PadUnderKnife& pad, const std::vector<double>& x_m, Rest rest) {
  TemplateStroke stroke;
  for (std::size_t i = 0; i < x_m.size(); ++i) {
    pad.follow(stroke, pad.at(x_m[i], 0.0143, kDepth_m));
    ASSERT_TRUE(pad.valid());
    rest(i, stroke);
  }
  pad.lift(stroke);
  ASSERT_TRUE(pad.valid());
}
void cut_planes(PadUnderKnife& pad, const std::vector<double>& x_m) {
  cut_planes(pad, x_m, [](std::size_t, TemplateStroke&) {});
}

const std::vector<double> kFourPlanes{0.0115, 0.0187, 0.0262, 0.0334, 0.0417}, kOnePlane{0.0115, 0.0417};

// A mesh as a set of triangles by their corners, to a micrometre: slots may differ.
using Place = std::array<long, 3>;
std::multiset<std::array<Place, 3>> shape_of(const TriangleMesh& mesh) {
  std::multiset<std::array<Place, 3>> shape;
  for (const Triangle& t : mesh.triangles()) {
    if (!t.alive()) continue;
    std::array<Place, 3> corners;
    for (std::size_t i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        corners[i][static_cast<std::size_t>(k)] = std::lround(1e6 * mesh.rest_body_m(t.v[i])[k]);
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    shape.insert(corners);
  }
  return shape;
}

TEST(A_SEQ, A_SEQ_1_four_planes_are_one_cut) {
  PadUnderKnife four, one;
  cut_planes(four, kFourPlanes);
  cut_planes(one, kOnePlane);
  EXPECT_EQ(four.mesh.triangle_count(), one.mesh.triangle_count());
  EXPECT_EQ(four.mesh.vertex_count(), one.mesh.vertex_count());
  EXPECT_TRUE(shape_of(four.mesh) == shape_of(one.mesh)) << "triangle for triangle";
  EXPECT_NEAR(check(four.mesh).volume_m3, check(one.mesh).volume_m3, 1e-12);
}

TEST(A_SEQ, A_SEQ_1_a_hundred_steps_are_one_cut) {
  PadUnderKnife hundred, one;
  std::vector<double> x;
  for (int i = 0; i <= 100; ++i) x.push_back(0.0115 + 3.02e-4 * i);
  cut_planes(hundred, x);
  cut_planes(one, kOnePlane);
  EXPECT_TRUE(shape_of(hundred.mesh) == shape_of(one.mesh));
}

TEST(A_SEQ, A_SEQ_2_a_rest_with_other_actions_changes_nothing) {
  PadUnderKnife rested, one;
  cut_planes(rested, kFourPlanes, [&](std::size_t i, TemplateStroke& stroke) {
    if (i != 2) return;
    // The instrument stays for a hundred steps; elsewhere another one cuts, from step to step; the body moves.
    TemplateStroke other;
    for (int k = 0; k < 100; ++k) {
      MeshDraft draft(rested.mesh, rested.view());
      Grooves& grooves = rested.grooves;
      ASSERT_TRUE(undo_temporary(draft, other));
      ASSERT_TRUE(undo_temporary(draft, stroke));
      const RestBlade here = rested.at(kFourPlanes[2], 0.0143, kDepth_m),
                      there = rested.at(0.0115 + 3e-4 * k, 0.034, 0.004);
      const auto all = rested.all_triangles();
      ASSERT_EQ(advance(draft, stroke, here, all, grooves, rested.settings), TemplateStrokeEnd::going);
      ASSERT_EQ(advance(draft, other, there, all, grooves, rested.settings), TemplateStrokeEnd::going);
      open_temporarily(draft, stroke, rested.settings);
      open_temporarily(draft, other, rested.settings);
      ASSERT_TRUE(rested.commit(draft));
      ASSERT_TRUE(rested.valid());
      for (VertexId v = 0; v < rested.mesh.vertex_slots(); ++v)
        rested.particles.position_world_m[v].z() += k < 50 ? 1e-5f : -1e-5f;
    }
    for (VertexId v = 0; v < rested.mesh.vertex_slots(); ++v)  // home again, to the last bit
      for (int j = 0; j < 3; ++j)
        rested.particles.position_world_m[v][j] = static_cast<float>(rested.mesh.rest_body_m(v)[j]);
    MeshDraft draft(rested.mesh, rested.view());
    Grooves& grooves = rested.grooves;
    ASSERT_TRUE(undo_temporary(draft, other));
    ASSERT_TRUE(undo_temporary(draft, stroke));
    finish(draft, other, grooves);
    open_temporarily(draft, stroke, rested.settings);
    ASSERT_TRUE(rested.commit(draft));
  });
  cut_planes(one, kOnePlane);
  // The cut itself is the same: all triangles of `one` that changed against a fresh pad are there.
  const auto expected = shape_of(one.mesh), found = shape_of(rested.mesh), fresh = shape_of(PadUnderKnife().mesh);
  std::size_t new_ones = 0;
  for (const auto& t : expected) {
    if (fresh.contains(t)) continue;
    ++new_ones;
    EXPECT_TRUE(found.contains(t));
  }
  EXPECT_GT(new_ones, 40u);
}

TEST(A_SEQ, A_SEQ_3_a_cut_in_leaves_one_closed_component) {
  PadUnderKnife pad;
  cut_planes(pad, kFourPlanes);
  const SurfaceReport r = check(pad.mesh);
  EXPECT_EQ(r.components, 1u);
  EXPECT_EQ(r.euler_characteristic, 2);
}

TEST(A_SEQ, A_SEQ_3_a_cut_in_through_an_edge_and_on) {
  for (const double depth_m : {0.003, 0.0083, 0.0151, 0.025}) {
    PadUnderKnife pad;
    TemplateStroke stroke;
    for (int i = 0; i <= 40; ++i) {
      ASSERT_EQ(pad.follow(stroke, pad.at(-0.004 + 1e-3 * i, 0.0143, depth_m)), TemplateStrokeEnd::going)
          << "step " << i << " depth " << depth_m;
      ASSERT_TRUE(pad.valid());
    }
    EXPECT_EQ(check(pad.mesh).components, 1u);
    EXPECT_EQ(check(pad.mesh).euler_characteristic, 2);
  }
}

TEST(A_SEQ, A_SEQ_5_a_complete_cut_in_many_steps) {
  for (const double step_m : {1e-2, 1.7e-3, 3e-4}) {
    PadUnderKnife pad;
    TemplateStroke stroke;
    TemplateStrokeEnd end = TemplateStrokeEnd::going;
    for (double x = -0.004; x < 0.08 && end == TemplateStrokeEnd::going; x += step_m) {
      end = pad.follow(stroke, pad.at(x, 0.0143, 0.025));
      ASSERT_TRUE(pad.valid());
    }
    EXPECT_EQ(end, TemplateStrokeEnd::left_body);
    EXPECT_EQ(check(pad.mesh).components, 2u) << "steps of " << step_m;
    EXPECT_EQ(check(pad.mesh).euler_characteristic, 4);
  }
}

TEST(A_SEQ, A_SEQ_2_lifted_out_and_put_back_goes_on_with_the_same_groove) {
  PadUnderKnife lifted, one;
  TemplateStroke first, second;
  for (const double x : {0.0115, 0.0187, 0.0262}) lifted.follow(first, lifted.at(x, 0.0143, kDepth_m));
  lifted.lift(first);
  ASSERT_TRUE(lifted.valid());
  // Not quite at the same place.
  for (const double x : {0.0259, 0.0334, 0.0417}) lifted.follow(second, lifted.at(x, 0.0146, kDepth_m));
  lifted.lift(second);
  ASSERT_TRUE(lifted.valid());
  cut_planes(one, kOnePlane);
  EXPECT_EQ(check(lifted.mesh).components, 1u);
  EXPECT_EQ(check(lifted.mesh).euler_characteristic, 2);
  EXPECT_EQ(lifted.grooves.fronts.size(), 2u) << "one groove with two ends";
  EXPECT_NEAR(check(lifted.mesh).volume_m3, check(one.mesh).volume_m3, 2e-9);
}

// Several knives in the pad at once, as a plan sees them.
class Knives : public TemplatesOnMesh {
 public:
  Knives() : TemplatesOnMesh(box(6, 4, 2, Vec3(0.06, 0.04, 0.02))) {
    for (std::uint32_t tool = 0; tool < 3; ++tool) enter(0, Vec3::Constant(1.0 / 3), tool);
  }
  BladeMotion to(std::uint32_t tool, double x_m, double y_m, double depth_m) const {
    BladeMotion motion{tool, {{Vec3(x_m, y_m, 0.02 - depth_m), Vec3::UnitZ()}}, false};
    for (TriangleId t = 0; t < mesh.triangle_slots(); ++t)
      if (mesh.triangle(t).alive()) motion.active.push_back(t);
    return motion;
  }
};

// Figure 7, left: two sequences with different starts, each interrupted by the other and by a third action.
TEST(A_SEQ, A_SEQ_4_two_interleaved_sequences_divide_the_body_in_the_step_in_which_they_meet) {
  for (const double meeting_m : {0.021, 0.0287, 0.0344, 0.0413})
    for (const double beside_m : {0.0, 0.0004, -0.0011, 0.0017}) {
      Knives knives;
      StrokeEnd end = StrokeEnd::going;
      for (int i = 0; i < 400 && end == StrokeEnd::going; ++i) {
        const double left_m = -0.004 + 2e-4 * i, right_m = 0.064 - 2e-4 * i;
        std::vector<BladeMotion> motions{knives.to(1, right_m, 0.0143 + beside_m, 0.026)};
        if (left_m < meeting_m) motions.push_back(knives.to(0, left_m, 0.0143, 0.025));
        if (i % 3 == 0 && i < 90) motions.push_back(knives.to(2, 0.012 + 1e-4 * i, 0.033, 0.004));
        EXPECT_EQ(check(knives.mesh).components, 1u);
        const CutPlan plan = knives.step(motions);
        ASSERT_NO_FATAL_FAILURE(knives.expect_valid());
        ASSERT_EQ(plan.refused, 0u) << meeting_m << ' ' << beside_m << " step " << i;
        for (const StrokeOutcome& o : plan.outcomes)
          if (o.edge_id == 1) end = o.end;
      }
      EXPECT_EQ(end, StrokeEnd::joined) << meeting_m << ' ' << beside_m;
      EXPECT_EQ(check(knives.mesh).components, 2u) << meeting_m << ' ' << beside_m;
      EXPECT_EQ(check(knives.mesh).euler_characteristic, 4);
    }
}

TEST(A_SEQ, A_SEQ_4_a_cut_comes_round_to_its_own_beginning) {
  for (const double radius_m : {0.007, 0.0093, 0.0117}) {
    KnifeOnMesh pad(box(24, 16, 2, Vec3(0.06, 0.04, 0.02)));
    TemplateStroke stroke;
    TemplateStrokeEnd end = TemplateStrokeEnd::going;
    double a = 0;
    for (; a < 2.2 * M_PI && end == TemplateStrokeEnd::going; a += 0.03) {
      end = pad.follow(stroke,
                       PadUnderKnife::at(0.0303 + radius_m * std::cos(a), 0.0204 + radius_m * std::sin(a), 0.025));
      ASSERT_TRUE(pad.valid()) << a;
    }
    EXPECT_EQ(end, TemplateStrokeEnd::joined) << radius_m;
    EXPECT_NEAR(a, 2 * M_PI, 0.5);
    EXPECT_EQ(check(pad.mesh).components, 2u) << "a plug comes out";
  }
}

TEST(A_SEQ, A_SEQ_5_a_cut_past_a_hole_and_through_it) {
  const double height_m = 0.006;
  KnifeOnMesh knife(torus(16, 8, 0.05, 0.02));
  // Right through the ring from one side to the other, with the tip below it: the hole is in the way.
  TemplateStroke stroke;
  TemplateStrokeEnd end = TemplateStrokeEnd::going;
  for (double x = -0.08; x < 0.09 && end == TemplateStrokeEnd::going; x += 0.0017) {
    end = knife.follow(stroke, {Vec3(x, height_m, -0.03), Vec3::UnitZ()});
    ASSERT_TRUE(knife.valid());
  }
  TemplateStroke again;
  for (double x = 0.0; x < 0.09; x += 0.0017) {
    if (knife.follow(again, {Vec3(x, height_m, -0.03), Vec3::UnitZ()}) != TemplateStrokeEnd::going) break;
    ASSERT_TRUE(knife.valid());
  }
  EXPECT_EQ(check(knife.mesh).components, 2u);
}

TEST(A_SEQ, A_SEQ_5_a_hole_within_the_plane_is_cut_up_to_its_middle_first) {
  // A slit right through the pad, then a cut along the pad's length whose plane crosses it.
  PadUnderKnife pad;
  ASSERT_EQ(pad.cut({Vec3(0.03, 0.0123, -0.005), Vec3::UnitZ()}, {Vec3(0.0312, 0.0172, -0.005), Vec3::UnitZ()}).outcome,
            TemplateOutcome::cut);
  ASSERT_EQ(check(pad.mesh).euler_characteristic, 0);
  TemplateStroke stroke;
  TemplateStrokeEnd end = TemplateStrokeEnd::going;
  for (const double x : {-0.004, 0.064}) end = pad.follow(stroke, pad.at(x, 0.0143, 0.025));
  ASSERT_TRUE(pad.valid());
  EXPECT_EQ(end, TemplateStrokeEnd::left_body);
}

// Figure 12 and beyond: bodies with flat sides at many angles, knives from every direction.
struct Meeting {
  AngleClass angle;
  int edges;
  bool operator<(const Meeting& o) const { return std::pair(angle, edges) < std::pair(o.angle, o.edges); }
};

// A box as such, sheared, or with its upper side at an angle.
TriangleSoup body(int kind, int fine) {
  TriangleSoup soup = box(3 * fine, 2 * fine, fine, Vec3(0.06, 0.04, 0.02));
  for (Vec3& v : soup.vertices_body_m) {
    if (kind == 1) v.x() += 0.7 * v.z();
    if (kind == 2) v.x() -= 0.9 * v.z();
    if (kind == 3) v.z() *= 1 + 10 * v.x();
    if (kind == 4) v.z() += 0.4 * v.x(), v.y() += 0.3 * v.z();
  }
  return soup;
}

class Enumeration {
 public:
  void cut(const TriangleSoup& soup, const RestBlade& first, const RestBlade& last) {
    if (++situations % kSampled != 0) return;
    KnifeOnMesh knife(soup);
    const TemplateStep step = knife.cut(first, last);
    ++outcomes[step.outcome];
    ASSERT_TRUE(knife.valid());
    for (std::size_t i = 0; i < step.faces.size(); ++i) {
      const ActiveFace& b = step.faces[i];
      ++chosen[b.chosen];
      if (i == 0) continue;
      const ActiveFace& a = step.faces[i - 1];
      int shared = 0;
      for (const VertexId v : a.corners) shared += std::count(b.corners.begin(), b.corners.end(), v) > 0;
      if (shared < 2) continue;
      ++meetings[std::minmax(Meeting{a.angle, a.active_edges}, Meeting{b.angle, b.active_edges})];
    }
  }

  int situations = 0;
  std::map<TemplateOutcome, int> outcomes;
  std::map<const CutTemplate*, int> chosen;
  std::map<std::pair<Meeting, Meeting>, int> meetings;
};

// Knives at every angle to the sides, into, over and through the body.
void cut_from_everywhere(Enumeration& all) {
  for (int kind = 0; kind < 5; ++kind)
    for (const int fine : {1, 3})
      for (const double y_m : {0.0071, 0.02, 0.0262})
        for (const double turn : {0.0, 0.31, -0.47, 1.2})
          for (const double lean : {0.0, 0.25, -0.35, 0.8, M_PI})
            for (const double from_m : {-0.03, 0.004, 0.013})
              for (const double length_m : {0.0025, 0.011, 0.09})
                for (const double depth_m : {0.002, 0.0079, 0.04}) {
                  const Vec3 ahead(std::cos(turn), std::sin(turn), 0);
                  const Vec3 up = Eigen::AngleAxisd(lean, Vec3(-std::sin(turn), std::cos(turn), 0)) * Vec3::UnitZ();
                  const Vec3 tip = Vec3(0.02, y_m, 0.02) + (from_m - 0.01) * ahead - depth_m * up;
                  ASSERT_NO_FATAL_FAILURE(
                      all.cut(body(kind, fine), {tip, up}, {tip + length_m * ahead - 0.0007 * up, up}))
                      << kind << ' ' << fine << ' ' << y_m << ' ' << turn << ' ' << lean << ' ' << from_m << ' '
                      << length_m << ' ' << depth_m;
                }
}

// Short motions into a front that is within the tolerance of 90 degrees, but not upright.
void cut_along_the_front(Enumeration& all) {
  for (const double shear : {0.05, -0.05})
    for (const int fine : {1, 2, 3})
      for (const double y_m : {0.0031, 0.0133, 0.0262})
        for (double from_m = -0.0012; from_m < 0.0012; from_m += 1.3e-4)
          for (const double length_m : {0.00015, 0.0004, 0.0008})
            for (const double depth_m : {0.002, 0.0079, 0.0153, 0.0187, 0.03})
              for (const double deeper_m : {0.0, 0.004, -0.004}) {
                TriangleSoup soup = box(3 * fine, 2 * fine, fine, Vec3(0.06, 0.04, 0.02));
                for (Vec3& v : soup.vertices_body_m) v.x() += shear * v.z();
                const Vec3 tip(from_m, y_m, 0.02 - depth_m), up = Vec3::UnitZ();
                ASSERT_NO_FATAL_FAILURE(all.cut(soup, {tip, up}, {tip + Vec3(length_m, 0.1 * length_m, -deeper_m), up}))
                    << shear << ' ' << fine << ' ' << y_m << ' ' << from_m << ' ' << length_m << ' ' << depth_m;
              }
}

TEST(A_TPL, A_TPL_X_every_situation_and_every_meeting_of_templates_is_closed) {
  Enumeration all;
  ASSERT_NO_FATAL_FAILURE(cut_from_everywhere(all));
  ASSERT_NO_FATAL_FAILURE(cut_along_the_front(all));
  const int cuts = all.outcomes[TemplateOutcome::cut], refused = all.outcomes[TemplateOutcome::refused];
  std::printf("%d cuts, %d refused, %zu kinds of meeting\n", cuts, refused, all.meetings.size());
  EXPECT_GT(cuts, 10000 / kSampled);
  EXPECT_LT(refused, cuts / 100);
  for (const CutTemplate& t : cut_templates())
    EXPECT_GT(all.chosen[&t], 0) << "figure " << t.figure << ", class " << int(t.angle) << ", " << t.active_edges
                                 << " edges, " << t.least_inside << " inside";
  // Faces that meet across an edge have one or two active edges: all 6 * 7 / 2 pairs of them.
  for (int a = 0; a < 6; ++a)
    for (int b = a; b < 6; ++b) {
      const Meeting m{AngleClass(a / 2), 1 + a % 2}, n{AngleClass(b / 2), 1 + b % 2};
      EXPECT_GT(all.meetings[std::minmax(m, n)], 0)
          << "class " << a / 2 << " with " << 1 + a % 2 << " edges meets class " << b / 2 << " with " << 1 + b % 2;
    }
}

}  // namespace
}  // namespace sectio::test
