// Paper A, section 2.3: cutting templates.
#include <gtest/gtest.h>

#include <map>

#include "common/mesh/check.h"
#include "tests/support/knife_on_mesh.h"

namespace sectio::test {
namespace {

std::size_t bottoms_among(const PadUnderKnife& pad, const std::vector<Triangle>& walls) {
  std::size_t n = 0;
  for (const Triangle& t : walls) n += pad.normal(t).z() > 0.9;
  return n;
}

// Walls whose centre lies between two abscissae.
std::vector<Triangle> walls_between(const PadUnderKnife& pad, double from_m, double to_m) {
  std::vector<Triangle> result;
  for (const Triangle& t : pad.walls())
    if (pad.centre(t).x() > from_m && pad.centre(t).x() < to_m) result.push_back(t);
  return result;
}

// Along y = 14 mm from the face above the diagonal of cell 1, 1 (crossed at x = 14 mm) to that of cell 2, 1: the faces
// between, divided at x = 20 mm, have two active edges.
struct Along : testing::Test {
  PadUnderKnife pad;
  TemplateStep step = pad.cut(pad.at(0.0115, 0.014, 0.006), pad.at(0.0265, 0.014, 0.006));
};

TEST_F(Along, A_TPL_N1_one_active_edge_four_faces_three_new_vertices) {
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_TRUE(pad.valid());
  ASSERT_EQ(step.faces.size(), 4u);
  for (const std::size_t end : {0u, 3u}) {
    EXPECT_EQ(step.faces[end].angle, AngleClass::normal);
    EXPECT_EQ(step.faces[end].active_edges, 1);
    EXPECT_EQ(step.faces[end].vertices_inside, 1);
    EXPECT_STREQ(step.faces[end].chosen->figure, "10 left");
  }
  const std::vector<Triangle> faces = pad.upper(1, 1, true);
  ASSERT_EQ(faces.size(), 4u);
  std::set<VertexId> vertices;
  for (const Triangle& t : faces) vertices.insert(t.v.begin(), t.v.end());
  EXPECT_EQ(vertices.size(), 6u) << "three old, a pair on the active edge, one at the tip";
  double area_m2 = 0;
  for (const Triangle& t : faces)
    area_m2 += (pad.x(t.v[1]) - pad.x(t.v[0])).cross(pad.x(t.v[2]) - pad.x(t.v[0])).z() / 2;
  // Less the incision. The pair stands across the path and so beside the diagonal, which is 4 mm long (in x) before it
  // and 6 mm after it: one part gains half a width times 4 mm / 2, the other loses as much times 6 mm / 2.
  const double width_m = pad.settings.open_top_m;
  EXPECT_NEAR(area_m2, 50e-6 - 0.5 * 0.0025 * width_m - 0.5 * (0.5 * width_m) * (0.006 - 0.004), 1e-15);
  // Its substructure, in x from the tip to the pair: two sides of two triangles, a bottom of one.
  const auto walls = walls_between(pad, 0.0115, 0.014);
  EXPECT_EQ(walls.size(), 5u);
  EXPECT_EQ(bottoms_among(pad, walls), 1u);
}

TEST(A_TPL, A_TPL_N1_tapers_to_the_tip_where_no_vertex_is_inside) {
  PadUnderKnife pad;
  const TemplateStep step = pad.cut(pad.at(0.0105, 0.014, -0.002), pad.at(0.0265, 0.014, 0.006));
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_TRUE(pad.valid());
  // The tip enters the upper side a quarter of the way, at x = 14.5 mm: the face below the diagonal.
  ASSERT_EQ(step.faces.size(), 3u);
  EXPECT_EQ(step.faces[0].active_edges, 1);
  EXPECT_EQ(step.faces[0].vertices_inside, 0);
  EXPECT_EQ(step.faces[0].chosen->substructure, Substructure::taper);
  EXPECT_EQ(walls_between(pad, 0.0145, 0.02).size(), 3u);
}

TEST_F(Along, A_TPL_N2_two_active_edges_three_faces_four_new_vertices) {
  for (const std::size_t midway : {1u, 2u}) {
    EXPECT_EQ(step.faces[midway].active_edges, 2);
    EXPECT_STREQ(step.faces[midway].chosen->figure, "10 right");
  }
  for (const auto& [column, above] : {std::pair{1, false}, {2, true}}) {
    const std::vector<Triangle> faces = pad.upper(column, 1, above);
    ASSERT_EQ(faces.size(), 3u);
    std::map<VertexId, int> uses;
    for (const Triangle& t : faces)
      for (const VertexId v : t.v) ++uses[v];
    EXPECT_EQ(uses.size(), 7u) << "three old, four new";
    // One triangle alone, two that share an edge: two areas that are not connected.
    std::map<VertexId, int> beside;
    int alone = 0;
    for (const Triangle& t : faces) {
      int shared = 0;
      for (const VertexId v : t.v) shared += uses[v] > 1;
      alone += shared == 0;
    }
    EXPECT_EQ(alone, 1);
  }
}

TEST_F(Along, A_TPL_N2_u_shape_has_three_sides_of_two_triangles) {
  for (const auto& [from, to] : {std::pair{0.014, 0.02}, {0.02, 0.024}}) {
    const auto walls = walls_between(pad, from, to);
    EXPECT_EQ(walls.size(), 6u);
    EXPECT_EQ(bottoms_among(pad, walls), 2u);
    std::size_t found = 0;
    for (const Triangle& t : walls)
      found += std::all_of(t.v.begin(), t.v.end(), [&](VertexId v) { return step.bottoms.contains(v); });
    EXPECT_EQ(found, 2u) << "bottom faces are found again by their vertices";
  }
}

TEST_F(Along, A_CUT_2_templates_first_then_faces_then_structures_and_closed) {
  EXPECT_TRUE(pad.valid());
  for (const ActiveFace& f : step.faces) EXPECT_NE(f.chosen, nullptr);
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 2);
  // Faces and structures are there only together: nothing of a refused step is.
  PadUnderKnife other;
  const std::uint64_t hash = other.mesh.hash();
  const CutFront elsewhere{0, 1, false, 2, 3, Vec3::UnitX(), {}};
  EXPECT_EQ(other.cut(other.at(0.03, 0.014, 0.006), other.at(0.035, 0.014, 0.006), {{elsewhere}}).outcome,
            TemplateOutcome::refused);
  EXPECT_EQ(other.mesh.hash(), hash);
}

TEST(A_CUT, A_CUT_3_template_chosen_by_angle_edges_and_vertices_inside_only) {
  std::set<const CutTemplate*> chosen;
  for (const AngleClass angle : {AngleClass::normal, AngleClass::right_angle, AngleClass::beyond})
    for (int edges = 0; edges <= 2; ++edges)
      for (int inside = 0; inside <= 2; ++inside) {
        int fit = 0;
        for (const CutTemplate& t : cut_templates())
          fit += t.angle == angle && t.active_edges == edges && t.least_inside <= inside && inside <= t.most_inside;
        EXPECT_EQ(fit, 1) << "angle class " << int(angle) << ", " << edges << " edges, " << inside << " inside";
        const CutTemplate& t = template_for(angle, edges, inside);
        chosen.insert(&t);
        EXPECT_EQ(t.faces, edges == 0 ? 7 : edges == 1 ? 4 : 3);
        EXPECT_EQ(t.new_vertices, edges == 1 ? 3 : 4);
        EXPECT_TRUE(edges == 0 || angle == AngleClass::normal || t.substructure_triangles == 0);
      }
  EXPECT_EQ(chosen.size(), cut_templates().size()) << "no template that nothing chooses";
}

TEST(A_CUT, A_CUT_3_boundaries_of_the_angle_classes) {
  const auto at = [](double degrees) {
    const double a = degrees * M_PI / 180;
    return angle_class(Vec3::UnitZ(), Vec3(std::sin(a), 0, std::cos(a)));
  };
  const double tolerance = kRightAngleTolerance_rad * 180 / M_PI, e = 1e-6;
  EXPECT_EQ(at(0), AngleClass::normal);
  EXPECT_EQ(at(90 - tolerance - e), AngleClass::normal);
  EXPECT_EQ(at(90 - tolerance + e), AngleClass::right_angle);
  EXPECT_EQ(at(90 - e), AngleClass::right_angle);
  EXPECT_EQ(at(90), AngleClass::right_angle);
  EXPECT_EQ(at(90 + e), AngleClass::right_angle);
  EXPECT_EQ(at(90 + tolerance - e), AngleClass::right_angle);
  EXPECT_EQ(at(90 + tolerance + e), AngleClass::beyond);
  EXPECT_EQ(at(180), AngleClass::beyond);
}

TEST(A_CUT, A_CUT_4_openings_have_their_widths_square_to_the_path) {
  for (const double degrees : {0.0, 17.0, 40.0, -33.0}) {
    TemplateSettings settings;
    settings.open_top_m = 6e-4;
    settings.open_bottom_m = 3e-4;
    PadUnderKnife pad(settings);
    const Vec3 ahead(std::cos(degrees * M_PI / 180), std::sin(degrees * M_PI / 180), 0);
    const Vec3 from(0.0125, 0.0185, 0), to = from + 0.025 * ahead;
    const std::uint32_t old_vertices = pad.mesh.vertex_slots();
    const TemplateStep step = pad.cut(pad.at(from.x(), from.y(), 0.006), pad.at(to.x(), to.y(), 0.006));
    ASSERT_EQ(step.outcome, TemplateOutcome::cut);
    ASSERT_TRUE(pad.valid());
    const Vec3 left = Vec3::UnitZ().cross(ahead);
    int top = 0, bottom = 0;
    for (VertexId v = old_vertices; v < pad.mesh.vertex_slots(); ++v) {
      const double beside = (pad.x(v) - from).dot(left), along = (pad.x(v) - from).dot(ahead);
      if (along < 1e-6 || along > 0.025 - 1e-6) continue;  // the ends are single
      const bool on_top = pad.x(v).z() > pad.kTop_m - 1e-9;
      EXPECT_NEAR(std::abs(beside), on_top ? 3e-4 : 1.5e-4, 1e-8);
      // Its partner is square across.
      int across = 0;
      for (VertexId w = old_vertices; w < pad.mesh.vertex_slots(); ++w)
        across += (pad.x(w) - (pad.x(v) - 2 * beside * left)).norm() < 1e-8;
      EXPECT_EQ(across, 1);
      ++(on_top ? top : bottom);
    }
    EXPECT_GE(top, 6);
    EXPECT_EQ(top, bottom);
  }
}

TEST(A_CUT, A_CUT_5_bottoms_are_born_above_the_tip_and_go_to_it_in_the_next_step) {
  PadUnderKnife pad;
  TemplateStroke stroke;
  const auto deepest = [&] {
    std::map<int, double> depth;  // by tenths of a millimetre along the cut
    std::set<VertexId> bottoms = stroke.temporary_bottoms;
    bottoms.insert(pad.grooves.bottoms.begin(), pad.grooves.bottoms.end());
    for (const VertexId v : bottoms)
      if (pad.mesh.vertex_alive(v)) depth[int(std::lround(1e4 * pad.x(v).x()))] = pad.kTop_m - pad.x(v).z();
    return depth;
  };
  for (const double x : {0.0115, 0.0225}) pad.follow(stroke, pad.at(x, 0.014, 0.006));
  ASSERT_TRUE(pad.valid());
  for (const auto& [x, depth_m] : deepest()) EXPECT_NEAR(depth_m, 0.75 * 0.006, 1e-6) << "born at x = " << x;
  ASSERT_FALSE(stroke.bottoms_at_tip.empty());
  const auto born = deepest();
  pad.follow(stroke, pad.at(0.0227, 0.014, 0.006));
  ASSERT_TRUE(pad.valid());
  int adapted = 0;
  for (const auto& [x, depth_m] : deepest()) {
    if (x >= 199) continue;
    EXPECT_NEAR(depth_m, 0.006, 1e-6) << "at x = " << x;
    ++adapted;
  }
  EXPECT_GE(adapted, 2);
}

TEST(A_CUT, A_CUT_6_only_active_faces_and_their_neighbours_are_read) {
  PadUnderKnife near, whole;
  const RestBlade first = near.at(0.0115, 0.014, 0.006), last = near.at(0.0265, 0.014, 0.006);
  whole.cut(first, last);
  // The active faces with the ring of their vertices' faces; everything else is not a number.
  std::vector<TriangleId> active;
  std::set<VertexId> read;
  for (TriangleId t = 0; t < near.mesh.triangle_slots(); ++t) {
    const Triangle& f = near.mesh.triangle(t);
    const Vec3 c = near.centre(f);
    if (c.z() > 0.0199 && c.y() > 0.01 && c.y() < 0.02 && c.x() > 0.01 && c.x() < 0.03) active.push_back(t);
  }
  const MeshDraft reader(near.mesh, near.view());
  for (const TriangleId t : active)
    for (const VertexId v : near.mesh.triangle(t).v)
      for (const TriangleId n : reader.fan(v))
        read.insert(near.mesh.triangle(n).v.begin(), near.mesh.triangle(n).v.end());
  const std::array<VertexId, 3> active_vertices = near.mesh.triangle(active[0]).v;
  ASSERT_LT(read.size(), near.mesh.vertex_count() / 2);
  for (VertexId v = 0; v < near.mesh.vertex_slots(); ++v)
    if (!read.contains(v)) near.particles.position_world_m[v].x() = std::numeric_limits<float>::quiet_NaN();
  MeshDraft draft(near.mesh, near.view());
  const TemplateStep step = cut_with_templates(draft, first, last, {}, active, near.settings);
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  const TopologyDelta delta = draft.delta();
  for (const TriangleEdit& e : delta.triangles)
    for (const VertexId v : e.id < near.mesh.triangle_slots() ? near.mesh.triangle(e.id).v : active_vertices)
      EXPECT_TRUE(read.contains(v));
  ASSERT_TRUE(near.commit(draft));
  EXPECT_TRUE(near.mesh.same_database(whole.mesh));
}

// A knife that comes through the front, the side x = 0, with its tip beneath the upper side.
TEST(A_TPL, A_TPL_90_1_the_neighbours_u_ends_on_the_triangular_incision) {
  PadUnderKnife pad;
  // Up the front at y = 14 mm: the tip 3 mm down, in the face at the upper edge (diagonals of the front at z = y).
  const TemplateStep step = pad.cut(pad.at(-0.005, 0.014, 0.003), pad.at(0.0165, 0.014, 0.003));
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_TRUE(pad.valid());
  ASSERT_EQ(step.faces.front().angle, AngleClass::right_angle);
  EXPECT_EQ(step.faces.front().active_edges, 1);
  EXPECT_STREQ(step.faces.front().chosen->figure, "11 left");
  std::vector<Triangle> front_walls, front_skin;
  for (const Triangle& t : pad.mesh.triangles()) {
    if (!t.alive() || std::abs(pad.centre(t).x()) > 1e-9) continue;
    if (t.surface == Surface::wall) front_walls.push_back(t);
  }
  EXPECT_TRUE(front_walls.empty()) << "no substructure of the front face";
  // The first U, up to the first crossing of the upper side at x = 4 mm: both sides of two triangles, but a bottom of
  // one, which narrows to the tip of the incision.
  const auto walls = walls_between(pad, 0, 0.004);
  EXPECT_EQ(walls.size(), 5u);
  EXPECT_EQ(bottoms_among(pad, walls), 1u);
}

TEST(A_TPL, A_TPL_90_2_two_active_edges_then_one_on_the_front) {
  PadUnderKnife pad;
  const TemplateStep step = pad.cut(pad.at(-0.005, 0.014, 0.0083), pad.at(0.0165, 0.014, 0.0083));
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_TRUE(pad.valid());
  ASSERT_GE(step.faces.size(), 3u);
  EXPECT_EQ(step.faces[0].angle, AngleClass::right_angle);
  EXPECT_EQ(step.faces[0].active_edges, 1);
  EXPECT_EQ(step.faces[1].angle, AngleClass::right_angle);
  EXPECT_EQ(step.faces[1].active_edges, 2);
  EXPECT_STREQ(step.faces[1].chosen->figure, "11 right");
  const auto walls = walls_between(pad, 0, 0.004);
  EXPECT_EQ(walls.size(), 7u) << "sides of three triangles each end on both incisions, bottom of one";
}

TEST(A_TPL, A_TPL_O_a_knife_goes_right_through_an_edge_of_the_body) {
  PadUnderKnife pad;
  const std::uint32_t old_vertices = pad.mesh.vertex_slots();
  const double volume = check(pad.mesh).volume_m3;
  const TemplateStep step = pad.cut(pad.at(-0.005, 0.014, 0.025), pad.at(0.0165, 0.014, 0.025));
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_TRUE(pad.valid());
  int top = 0, front = 0, underside = 0;
  for (const ActiveFace& f : step.faces) {
    top += f.angle == AngleClass::normal;
    front += f.angle == AngleClass::right_angle;
    underside += f.angle == AngleClass::beyond;
  }
  EXPECT_GT(top, 2);
  EXPECT_GT(front, 2);
  EXPECT_GT(underside, 2);
  // No vertex inside: all new ones are on the sides of the body, none above or below it.
  for (VertexId v = old_vertices; v < pad.mesh.vertex_slots(); ++v) {
    const double z = pad.x(v).z(), x = pad.x(v).x();
    EXPECT_TRUE(std::abs(z) < 1e-8 || std::abs(z - pad.kTop_m) < 1e-8 || std::abs(x) < 1e-8) << pad.x(v).transpose();
  }
  EXPECT_EQ(bottoms_among(pad, pad.walls()), 0u);
  // Side faces once: as many as two polygons with these corners need.
  std::size_t rim = 0;
  for (const ActiveFace& f : step.faces) rim += f.active_edges > 0;
  EXPECT_EQ(pad.walls().size(), 2 * (step.faces.size() + 1 - 2)) << rim;
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 2);
  EXPECT_LT(check(pad.mesh).volume_m3, volume);
  EXPECT_GT(check(pad.mesh).volume_m3, volume - 1.1 * 0.0165 * pad.kTop_m * pad.settings.open_top_m);
}

TEST(A_TPL, A_TPL_O_bottom_vertices_coincide_with_old_vertices_of_the_underside) {
  PadUnderKnife pad;
  const std::uint32_t old_vertices = pad.mesh.vertex_slots();
  // Along a line of vertices, y = 20 mm, turned a little so that the upper path lies beside them.
  const Vec3 up = Vec3(0, 0.04, 1).normalized();
  const TemplateStep step = pad.cut({Vec3(-0.005, 0.0198, -0.005), up}, {Vec3(0.0265, 0.0198, -0.005), up});
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_TRUE(pad.valid());
  int old_ones = 0;
  for (const Triangle& t : pad.walls())
    for (const VertexId v : t.v) old_ones += v < old_vertices && pad.x(v).z() < 1e-9;
  EXPECT_GT(old_ones, 2);
}

TEST(A_TPL, A_TPL_O_complete_cut_in_one_step) {
  PadUnderKnife pad;
  const double volume = check(pad.mesh).volume_m3;
  const TemplateStep step = pad.cut(pad.at(-0.005, 0.0143, 0.025), pad.at(0.065, 0.0143, 0.025));
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_TRUE(pad.valid());
  EXPECT_TRUE(step.fronts.empty());
  const SurfaceReport r = check(pad.mesh);
  EXPECT_EQ(r.components, 2u);
  EXPECT_EQ(r.euler_characteristic, 4);
  EXPECT_NEAR(r.volume_m3, volume - 0.06 * pad.kTop_m * pad.settings.open_top_m, 0.02 * 0.06 * pad.kTop_m * 4e-4);
}

struct InOneFace : testing::Test {
  PadUnderKnife pad;
};

TEST_F(InOneFace, A_TPL_0a_one_vertex_inside) {
  const TemplateStep step = pad.cut(pad.at(0.0110, 0.017, -0.002), pad.at(0.0150, 0.017, 0.006));
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_TRUE(pad.valid());
  ASSERT_EQ(step.faces.size(), 1u);
  EXPECT_EQ(step.faces[0].active_edges, 0);
  EXPECT_EQ(step.faces[0].vertices_inside, 1);
  EXPECT_STREQ(step.faces[0].chosen->figure, "14 left");
  EXPECT_EQ(pad.upper(1, 1, true).size(), 7u);
  EXPECT_EQ(pad.walls().size(), 4u);
  EXPECT_EQ(step.bottoms.size(), 1u) << "one new vertex inside";
}

TEST_F(InOneFace, A_TPL_0b_two_vertices_inside) {
  const TemplateStep step = pad.cut(pad.at(0.0120, 0.017, 0.005), pad.at(0.0150, 0.017, 0.006));
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_TRUE(pad.valid());
  ASSERT_EQ(step.faces.size(), 1u);
  EXPECT_EQ(step.faces[0].vertices_inside, 2);
  EXPECT_STREQ(step.faces[0].chosen->figure, "14 right");
  EXPECT_EQ(pad.upper(1, 1, true).size(), 7u) << "divided as with one vertex inside";
  EXPECT_EQ(pad.walls().size(), 6u);
  EXPECT_EQ(step.bottoms.size(), 2u);
}

TEST_F(InOneFace, A_TPL_0_through_a_plate) {
  const TemplateStep step = pad.cut(pad.at(0.0120, 0.0165, 0.03), pad.at(0.0140, 0.0165, 0.03));
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_TRUE(pad.valid());
  ASSERT_EQ(step.faces.size(), 2u);
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 0) << "a hole through the body";
}

TEST(A_TPL, A_TPL_C_continuation_discards_the_bottom_face_and_adjusts_the_sides) {
  PadUnderKnife pad;
  TemplateStep step = pad.cut(pad.at(0.0115, 0.014, 0.006), pad.at(0.0225, 0.014, 0.006));
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_EQ(step.fronts.size(), 1u);
  const CutFront front = step.fronts[0];
  ASSERT_FALSE(front.bottom_on_surface);
  const MeshDraft before(pad.mesh, pad.view());
  const TriangleId old_bottom = before.find_triangle(front.bottom, front.before_left, front.before_right);
  ASSERT_NE(old_bottom, kNone);
  step = pad.cut(pad.at(0.0225, 0.014, 0.006), pad.at(0.0285, 0.014, 0.006), {{front}});
  ASSERT_EQ(step.outcome, TemplateOutcome::cut);
  ASSERT_TRUE(pad.valid());
  const MeshDraft after(pad.mesh, pad.view());
  EXPECT_EQ(after.incident(front.top) != kNone, true);
  EXPECT_EQ(after.find_triangle(front.bottom, front.before_left, front.before_right) != kNone &&
                after.find_triangle(front.bottom, front.before_right, front.before_left) != kNone,
            false);
}

TEST(A_TPL, A_TPL_C_a_continued_sequence_grows_less_than_one_that_begins_anew) {
  PadUnderKnife continued, anew;
  const std::uint32_t fresh = continued.mesh.triangle_count();
  TemplateStroke stroke;
  int steps = 0;
  for (double x = 0.0115; x < 0.045; x += 0.0031, ++steps) {
    continued.follow(stroke, continued.at(x, 0.014, 0.006));
    ASSERT_TRUE(continued.valid());
    const TemplateStep step = anew.cut(anew.at(x, 0.014, 0.006), anew.at(x + 0.0029, 0.014, 0.006));
    ASSERT_EQ(step.outcome, TemplateOutcome::cut);
    ASSERT_TRUE(anew.valid());
  }
  const std::uint32_t growth = continued.mesh.triangle_count() - fresh;
  EXPECT_LT(2 * growth, anew.mesh.triangle_count() - fresh);
  // Within one face no step adds any.
  continued.follow(stroke, continued.at(0.0456, 0.014, 0.006));
  const std::uint32_t before = continued.mesh.triangle_count();
  for (int i = 1; i <= 200; ++i) continued.follow(stroke, continued.at(0.0456 + 1e-5 * i, 0.014, 0.006));
  ASSERT_TRUE(continued.valid());
  EXPECT_EQ(continued.mesh.triangle_count(), before);
}

// Half a millimetre aside is no turn: a plane across the front would lead into the groove's own wall.
TEST(A_TPL, A_TPL_C_a_hand_that_trembles_across_its_way_waits_until_it_is_ahead) {
  PadUnderKnife pad;
  TemplateStroke stroke;
  for (double x = 0.0115; x < 0.03; x += 0.001) pad.follow(stroke, pad.at(x, 0.014, 0.006));
  ASSERT_EQ(stroke.fronts.size(), 1u);
  const Vec3 end = pad.x(stroke.fronts[0].top);
  for (const double aside_m : {5e-4, -5e-4, 8e-4, -2e-4})
    EXPECT_EQ(pad.follow(stroke, pad.at(end.x() - 5e-5, end.y() + aside_m, 0.006)), TemplateStrokeEnd::going);
  ASSERT_EQ(stroke.fronts.size(), 1u);
  EXPECT_EQ(pad.x(stroke.fronts[0].top), end);
  for (double x = 0.031; x < 0.045; x += 0.001)
    EXPECT_EQ(pad.follow(stroke, pad.at(x, 0.014, 0.006)), TemplateStrokeEnd::going);
  EXPECT_GT(pad.x(stroke.fronts[0].top).x(), 0.04);
  EXPECT_TRUE(pad.valid());
}

// A blade that is put down presses the skin ahead before it breaks in: it comes in beyond the end, and goes on from it.
TEST(A_TPL, A_TPL_C_a_blade_that_breaks_in_just_beyond_the_end_goes_on_from_it) {
  PadUnderKnife pad;
  TemplateStroke first;
  for (double x = 0.0115; x < 0.03; x += 0.001) pad.follow(first, pad.at(x, 0.014, 0.006));
  pad.lift(first);
  const std::size_t ends = pad.grooves.fronts.size();
  ASSERT_EQ(ends, 2u);
  TemplateStroke second;
  second.entered_body_m = Vec3(0.0305, 0.0145, pad.kTop_m);
  for (double x = 0.0305; x < 0.045; x += 0.001) pad.follow(second, pad.at(x, 0.0145, 0.006));
  pad.lift(second);
  EXPECT_EQ(pad.grooves.fronts.size(), ends);
  EXPECT_TRUE(pad.valid());
}

TEST(A_TPL, A_TPL_C_deeper_along_an_old_groove_adds_no_triangle) {
  PadUnderKnife pad;
  TemplateStroke stroke;
  for (const double x : {0.0115, 0.0265, 0.0367}) pad.follow(stroke, pad.at(x, 0.014, 0.004));
  pad.lift(stroke);
  ASSERT_TRUE(pad.valid());
  const std::uint32_t triangles = pad.mesh.triangle_count();
  const double volume = check(pad.mesh).volume_m3;
  for (int pass = 1; pass <= 5; ++pass) {
    MeshDraft draft(pad.mesh, pad.view());
    const double depth_m = 0.004 + 0.001 * pass;
    const std::size_t moved = deepen_groove(draft, pad.at(0.0, 0.014, depth_m), pad.at(0.05, 0.014, depth_m),
                                            pad.grooves, pad.all_triangles(), pad.settings);
    EXPECT_EQ(moved, pad.grooves.bottoms.size());
    ASSERT_TRUE(pad.commit(draft));
    ASSERT_TRUE(pad.valid());
    EXPECT_EQ(pad.mesh.triangle_count(), triangles);
  }
  EXPECT_LT(check(pad.mesh).volume_m3, volume);
  for (const VertexId v : pad.grooves.bottoms) EXPECT_NEAR(pad.x(v).z(), pad.kTop_m - 0.009, 2e-5);
}

}  // namespace
}  // namespace sectio::test
