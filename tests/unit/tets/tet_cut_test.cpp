#include "sim_server/volume/tets/tet_cut.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/tet_shapes.h"

namespace sectio::tets_test {
namespace {

const TetCutSettings kExact{0, false};

TetMesh off_planes(int n = 3) {
  TetMesh mesh = test::tet_box(n, n, n, Vec3(0.06, 0.06, 0.06));
  for (Vec3& x : mesh.vertices_body_m) x += Vec3(0.0131, 0.0057, 0.0023);  // away from the planes of the cuts
  return mesh;
}
const Vec3 kMiddle = Vec3(0.03, 0.03, 0.03) + Vec3(0.0131, 0.0057, 0.0023);

// A rectangle around `at`, given by its half sides.
CutSheet sheet(const Vec3& at, const Vec3& u, const Vec3& w) {
  return {{at - u - w, at + u - w, at + u + w, at - u + w}};
}
TetReport report(const TetTopology& volume) {
  return check(volume.mesh());
}
TetMesh one_tetrahedron() {
  TetMesh mesh;
  mesh.vertices_body_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  return mesh;
}
std::vector<double> part_volumes(const TetMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices_body_m.size());
  for (std::uint32_t v = 0; v < parent.size(); ++v) parent[v] = v;
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const VertexId v : t) parent[root(v)] = root(t[0]);
  std::vector<double> volume(parent.size(), 0);
  for (const Tetrahedron& t : mesh.tetrahedra) volume[root(t[0])] += tet_volume_m3(mesh, t);
  std::erase(volume, 0.0);
  std::sort(volume.begin(), volume.end());
  return volume;
}

TEST(C_CUT, C_CUT_5_three_cut_edges_make_four_tetrahedra_and_four_make_six) {
  TetTopology corner(one_tetrahedron());
  const TetCutOutcome three = cut(corner, sheet(Vec3(0, 0, 0.3), Vec3(2, 0, 0), Vec3(0, 2, 0)), kExact);
  EXPECT_EQ(three.splits, 3u);
  EXPECT_EQ(corner.tetrahedra().size(), 4u);
  EXPECT_EQ(part_volumes(corner.mesh()).size(), 2u);
  EXPECT_NEAR(part_volumes(corner.mesh())[0], 0.7 * 0.7 * 0.7 / 6, 1e-15);
  EXPECT_NEAR(report(corner).volume_m3, 1.0 / 6, 1e-15);

  TetTopology across(one_tetrahedron());
  const TetCutOutcome four = cut(across, sheet(Vec3(0.2, 0.25, 0.25), Vec3(2, 0, 0), Vec3(0, 2, -2)), kExact);
  EXPECT_EQ(four.splits, 4u);
  EXPECT_EQ(across.tetrahedra().size(), 6u);
  EXPECT_EQ(part_volumes(across.mesh()).size(), 2u);
  EXPECT_TRUE(report(across).valid) << report(across).first_defect;
}

TEST(C_CUT, C_CUT_6_neighbours_match_and_a_cut_through_parts_at_the_plane) {
  for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(1, 2, 3), Vec3(-3, 1, 0.5)}) {
    TetTopology volume(off_planes());
    const Vec3 u = normal.unitOrthogonal(), w = normal.normalized().cross(u);
    cut(volume, sheet(kMiddle, u, w), kExact);
    EXPECT_TRUE(report(volume).valid) << report(volume).first_defect;
    EXPECT_NEAR(report(volume).volume_m3, 0.06 * 0.06 * 0.06, 1e-12 * 0.06 * 0.06 * 0.06);
    const std::vector<double> parts = part_volumes(volume.mesh());
    ASSERT_EQ(parts.size(), 2u);  // through the middle of a cube, whatever the direction, the halves are alike
    EXPECT_NEAR(parts[0], parts[1], 1e-12 * parts[0]);
  }
}

TEST(C_CUT, C_CUT_7_a_cut_that_ends_inside_stays_one_part_with_a_closed_tip) {
  TetTopology volume(off_planes(4));
  const TetCutOutcome outcome = cut(volume, sheet(kMiddle + Vec3(0.02, 0, 0), Vec3(0.025, 0, 0), Vec3(0, 1, 0.1)), {});
  EXPECT_GT(outcome.twins, 3u);
  EXPECT_EQ(part_volumes(volume.mesh()).size(), 1u);
  EXPECT_TRUE(report(volume).valid) << report(volume).first_defect;
  EXPECT_EQ(report(volume).components, 1u);
}

TEST(C_CUT, C_CUT_3_C_CUT_4_semi_progressive_cuts_only_what_is_cut_through) {
  // A nick that crosses one edge, and no element as a whole.
  TetTopology all(off_planes(4)), through(off_planes(4));
  const Tetrahedron t = all.tetrahedra()[160];
  const Vec3 a = all.vertex(t[0]).position_world_m, b = all.vertex(t[1]).position_world_m;
  const Vec3 u = 0.001 * (b - a).unitOrthogonal(), w = (b - a).normalized().cross(u);
  const CutSheet nick = sheet(0.6 * a + 0.4 * b, u, w);
  EXPECT_EQ(cut(all, nick, {0.08, false}).splits, 1u);
  EXPECT_FALSE(cut(through, nick, {0.08, true}).changed());
  EXPECT_TRUE(report(all).valid) << report(all).first_defect;
  // A cut through the whole body is the same in both modes.
  TetTopology c(off_planes()), d(off_planes());
  const CutSheet whole = sheet(kMiddle, Vec3(1, 0.2, 0), Vec3(0, 1, 0.1));
  cut(c, whole, {0.08, false});
  cut(d, whole, {0.08, true});
  EXPECT_EQ(c.mesh().tetrahedra, d.mesh().tetrahedra);
}

TEST(TetCut, snapping_goes_to_vertices_and_through_faces_without_splits) {
  TetMesh mesh = test::tet_box(4, 4, 4, Vec3(0.08, 0.08, 0.08));
  TetTopology volume(mesh);
  const TetCutOutcome outcome = cut(volume, sheet(Vec3(0.04, 0.04, 0.0405), Vec3(1, 0, 0), Vec3(0, 1, 0)), {});
  EXPECT_EQ(outcome.splits, 0u);
  EXPECT_EQ(outcome.snapped, 25u);
  EXPECT_EQ(outcome.twins, 25u);
  EXPECT_EQ(part_volumes(volume.mesh()).size(), 2u);
  EXPECT_TRUE(report(volume).valid) << report(volume).first_defect;
}

TEST(TetCut, a_second_cut_across_and_one_along_the_first) {
  TetTopology volume(off_planes());
  const CutSheet flat = sheet(kMiddle, Vec3(1, 0.1, 0), Vec3(0, 1, 0.1));
  cut(volume, flat, {});
  const std::size_t before = volume.tetrahedra().size();
  const TetCutOutcome again = cut(volume, flat, {});  // everything on the sheet has been cut
  EXPECT_EQ(again.twins, 0u);
  EXPECT_EQ(volume.tetrahedra().size(), before);
  cut(volume, sheet(kMiddle, Vec3(0.1, 0, 1), Vec3(0, 1, 0)), {});
  EXPECT_EQ(part_volumes(volume.mesh()).size(), 4u);
  EXPECT_TRUE(report(volume).conforming) << report(volume).first_defect;
}

// A second cut, a millimetre above the first, parts a slice from what is above it.
// A blade that goes slowly through a thread: each of its sheets turns a little.
TEST(TetCut, sheets_that_nearly_coincide_do_not_cut_each_others_elements_again_and_again) {
  const auto growth = [](double close_m) {
    TetTopology volume(off_planes());
    TetCutSettings settings;
    settings.close_m = close_m;
    const double before = report(volume).tetrahedra;
    for (int n = 0; n < 16; ++n) {
      const Vec3 u(0.1, 0, 0.002 * std::sin(2.4 * n)), w(0, 0.1, 0.002 * std::cos(2.4 * n));
      cut(volume, sheet(kMiddle, u, w), settings);
    }
    return report(volume).tetrahedra / before;
  };
  EXPECT_LT(growth(4e-4), 6);
  EXPECT_GT(growth(0), 60);
}

TEST(TetCut, a_crumb_stays_on_the_other_side_and_leaves_the_first_cut_open) {
  for (const double crumb_m3 : {0.0, 1e-5}) {
    TetTopology volume(off_planes());
    TetCutSettings settings;
    settings.crumb_m3 = crumb_m3;
    settings.snap = 0;
    cut(volume, sheet(kMiddle, Vec3(1, 0, 0), Vec3(0, 1, 0)), settings);
    ASSERT_EQ(part_volumes(volume.mesh()).size(), 2u);
    const Vec3 above = kMiddle + Vec3(0, 0, 0.001);
    EXPECT_EQ(cut(volume, sheet(above, Vec3(1, 0, 0), Vec3(0, 1, 0)), settings).twins > 0, crumb_m3 == 0);
    EXPECT_TRUE(report(volume).conforming) << report(volume).first_defect;
    const std::vector<double> parts = part_volumes(volume.mesh());
    ASSERT_EQ(parts.size(), crumb_m3 == 0 ? 3u : 2u);
    if (crumb_m3 > 0) {
      EXPECT_NEAR(parts[0], parts[1], 1e-9 * parts[0]);
    }
  }
}

bool same(const TetTopology& a, const TetTopology& b) {
  if (a.vertex_count() != b.vertex_count()) return false;
  for (VertexId v = 0; v < a.vertex_count(); ++v) {
    if (a.vertex(v).rest_body_m != b.vertex(v).rest_body_m) return false;
    if (!std::ranges::equal(a.star(v), b.star(v))) return false;
  }
  return std::ranges::equal(a.tetrahedra(), b.tetrahedra());
}

TEST(TetCut, undone_to_the_last_bit) {
  TetTopology volume(off_planes(4));
  cut(volume, sheet(kMiddle, Vec3(0.02, 0.001, 0), Vec3(0, 0.02, 0.004)), {});
  const TetTopology before = volume;
  const std::size_t mark = volume.mark();
  cut(volume, sheet(kMiddle + Vec3(0.01, 0, 0), Vec3(1, 0.1, 0.3), Vec3(0, 1, -0.2)), {});
  cut(volume, sheet(kMiddle, Vec3(0.3, 1, 0), Vec3(0, 0.2, 1)), {});
  EXPECT_FALSE(same(volume, before));
  volume.undo_to(mark);
  EXPECT_TRUE(same(volume, before));
}

double surface_m2(const TetTopology& volume) {
  const TetSurface surface = surface_of(volume.mesh());
  double sum = 0;
  for (const auto& [a, b, c] : surface.soup.triangles) {
    const auto& x = surface.soup.vertices_body_m;
    sum += 0.5 * (x[b] - x[a]).cross(x[c] - x[a]).norm();
  }
  return sum;
}

// A blade enters from the side with its tip inside and its edge aslant; three sides of the swept region are exact.
struct Swept {
  double tip_x_m, heel_x_m, tip_y_m;  // ends of the blade's edge; the heel is far outside

  CutSheet sheet() const {
    const double z_m = kMiddle.z() + 0.0017, heel_y_m = 0.1;
    return {{Vec3(-0.05, tip_y_m, z_m), Vec3(-0.05, heel_y_m, z_m), Vec3(heel_x_m, heel_y_m, z_m),
             Vec3(tip_x_m, tip_y_m, z_m)},
            {},
            2 | 4 | 8};
  }
  double edge_x_m(double y_m) const { return tip_x_m + (heel_x_m - tip_x_m) * (y_m - tip_y_m) / (0.1 - tip_y_m); }
  double inside_m2() const {
    const double side_m = 0.0131, end_m = 0.0657;  // sides of the block
    return (end_m - tip_y_m) * (0.5 * (edge_x_m(tip_y_m) + edge_x_m(end_m)) - side_m);
  }
};
Swept swept(int n) {
  const double x_m = 0.0172 + 0.0019 * n;  // elements are 15 mm
  return {x_m, x_m + 0.001 * (n % 7), 0.012 + 0.0023 * (n % 11)};
}

TEST(TetCut, opens_inside_elements_as_far_as_the_sheet_goes_and_is_undone_to_the_last_bit) {
  for (int n = 0; n < 24; ++n) {
    TetTopology volume(off_planes(4));
    const TetTopology before = volume;
    const double closed_m2 = surface_m2(volume);
    cut(volume, swept(n).sheet(), {1e-6});
    EXPECT_NEAR(0.5 * (surface_m2(volume) - closed_m2), swept(n).inside_m2(), 1e-9 * closed_m2) << n;
    const TetReport now = report(volume);
    EXPECT_TRUE(now.valid) << n << ": " << now.first_defect;
    EXPECT_EQ(now.components, 1u);
    EXPECT_NEAR(now.volume_m3, 0.06 * 0.06 * 0.06, 1e-12 * 0.06 * 0.06 * 0.06);
    volume.undo_to(0);
    EXPECT_TRUE(same(volume, before)) << n;
  }
}

// With snapping, each vertex of the opening is within the snapping fraction of an edge from the blade.
TEST(TetCut, the_tip_of_the_opening_is_at_the_blade_to_what_snapping_allows) {
  const double longest_m = 0.015 * std::sqrt(2.0), most_m = 0.08 * longest_m;
  double furthest_m = 0;
  for (int n = 0; n < 24; ++n) {
    TetTopology volume(off_planes(4));
    const std::size_t vertices = volume.vertex_count();
    cut(volume, swept(n).sheet(), {});
    EXPECT_TRUE(report(volume).conforming) << n << ": " << report(volume).first_defect;
    double front_m = -1;
    for (VertexId v = 0; v < volume.vertex_count(); ++v)
      for (VertexId twin = static_cast<VertexId>(vertices); twin < volume.vertex_count(); ++twin) {
        if (twin == v || volume.vertex(twin).rest_body_m != volume.vertex(v).rest_body_m) continue;
        // Open; so are its faces, up to the tip.
        for (const std::uint32_t t : volume.star(v))
          for (std::size_t corner = 0; corner < 4; ++corner) {
            const Tetrahedron& c = volume.tetrahedra()[t];
            if (c[corner] == v || volume.across(t, corner) != kNone) continue;
            const auto& [i, j, k] = kTetFaces[corner];
            for (const VertexId at : {c[i], c[j], c[k]}) {
              const Vec3& x = volume.vertex(at).rest_body_m;
              if (std::abs(x.z() - swept(n).sheet().outline_rest_m[0].z()) > most_m) continue;
              front_m = std::max(front_m, x.x() - swept(n).edge_x_m(x.y()));
              EXPECT_GT(x.y(), swept(n).tip_y_m - 2 * most_m) << n;
            }
          }
      }
    EXPECT_NEAR(front_m, 0, most_m) << n;
    furthest_m = std::max(furthest_m, std::abs(front_m));
  }
  EXPECT_GT(furthest_m, 0);
}

// A cut down and one sideways separate a corner, also if the two sheets meet inside an element.
TEST(C_CUT, C_CUT_8_a_stroke_with_a_bend_takes_a_corner_off) {
  for (const int n : {3, 4, 5}) {
    TetTopology volume(off_planes(n));
    const Vec3 a = kMiddle + Vec3(0.0071, -0.1, 0.05), b = kMiddle + Vec3(0.0071, 0.1, 0.05);
    const Vec3 down(0, 0, -0.045), aside = down + Vec3(0.05, 0, 0);
    const TetCutOutcome first = cut(volume, {{a, b, b + down, a + down}, {}, 2 | 4 | 8}, {});
    cut(volume, {{a + down, b + down, b + aside, a + aside}, first.on_sheet, 2 | 4 | 8}, {});
    EXPECT_TRUE(report(volume).conforming) << report(volume).first_defect;
    const std::vector<double> parts = part_volumes(volume.mesh());
    ASSERT_EQ(parts.size(), 2u) << n;
    EXPECT_NEAR(parts[0], 0.0229 * 0.06 * 0.025, 0.05 * 0.0229 * 0.06 * 0.025) << n;
  }
}

// By whole elements, a blade that turns on its way down takes the same corner off with one bent sheet, at any angle.
TEST(C_CUT, C_CUT_8_a_bent_sheet_takes_a_corner_off) {
  for (const int n : {3, 4, 5})
    for (const double aside_m : {0.05, 0.08}) {
      TetTopology volume(off_planes(n));
      const Vec3 a = kMiddle + Vec3(0.0071, -0.1, 0.05), b = kMiddle + Vec3(0.0071, 0.1, 0.05);
      const Vec3 down(0, 0, -0.045), end = down + Vec3(aside_m, 0, 0.3 * (aside_m - 0.05));
      CutSheet bent{{a, b, b + end, a + end}};
      bent.bends_rest_m = {{a + down, b + down}};
      cut(volume, bent, {0, true});
      EXPECT_TRUE(report(volume).conforming) << report(volume).first_defect;
      const std::vector<double> parts = part_volumes(volume.mesh());
      ASSERT_EQ(parts.size(), 2u) << n;
      const double corner_m3 = 0.0229 * 0.06 * (0.025 - (aside_m - 0.05) * 0.3 * 0.5 * 0.0229 / aside_m);
      EXPECT_NEAR(parts[0], corner_m3, 0.1 * corner_m3) << n;
    }
}

TEST(SheetShape, of_a_blade_that_turns_about_its_tip_ends_at_the_tip) {
  const Vec3 heel = Vec3::UnitZ(), ahead(0.3, 0, 0), aside(0.3, 0.3, 0);
  // Along x, a fan about the tip, along y.
  CutSheet bent{{Vec3::Zero(), heel, ahead + 2 * aside + heel, ahead + aside}};
  bent.bends_rest_m = {{ahead, ahead + heel}, {ahead, aside + ahead + heel}};
  const SheetShape shape(bent);
  const auto inside = [&](const Vec3& p) { return shape.inside(p, [](std::size_t) { return true; }); };
  EXPECT_TRUE(inside(0.5 * ahead + 0.5 * heel));
  EXPECT_TRUE(inside(ahead + 0.4 * aside + 0.8 * heel));
  for (const double depth : {0.1, 1.0, 10.0}) {
    EXPECT_FALSE(inside(ahead - depth * heel)) << depth;
    EXPECT_FALSE(inside(ahead - depth * (heel + 0.5 * aside))) << depth;
    EXPECT_FALSE(inside(ahead + (1 + depth) * heel + 0.5 * aside)) << depth;
  }
}

TEST(TetCut, A_20_a_cut_leaves_deformation_energy_and_momentum_as_they_were) {
  const TetMesh mesh = off_planes();
  TetTopology volume(mesh);
  std::vector<Vec3> x;
  for (VertexId v = 0; v < mesh.vertices_body_m.size(); ++v) {
    const Vec3& p = mesh.vertices_body_m[v];
    x.push_back(Vec3(1.1 * p.x() + 2 * p.y() * p.z(), p.y() - 0.1 * p.x(), 0.95 * p.z()));
    volume.set_state(v, x.back(), Vec3(std::sin(100 * p.x()), p.y() * p.z() * 100, std::cos(80 * p.z())));
  }
  const auto momentum = [](const TetTopology& of) {
    const TetMesh now = of.mesh();
    Vec3 sum = Vec3::Zero();
    for (const Tetrahedron& t : now.tetrahedra)
      for (const VertexId v : t) sum += 1000 * tet_volume_m3(now, t) / 4 * of.vertex(v).velocity_m_per_s;
    return sum;
  };
  // Each tetrahedron has one deformation gradient F, so that any density of energy W(F) does.
  const auto energy = [](const TetTopology& of) {
    const TetMesh now = of.mesh();
    double sum_j = 0;
    for (const Tetrahedron& t : now.tetrahedra) {
      Mat3 rest, world;
      for (int k = 0; k < 3; ++k) {
        rest.col(k) = now.vertices_body_m[t[k + 1]] - now.vertices_body_m[t[0]];
        world.col(k) = of.vertex(t[k + 1]).position_world_m - of.vertex(t[0]).position_world_m;
      }
      const Mat3 f = world * rest.inverse();
      sum_j += 1000 * (f.transpose() * f - Mat3::Identity()).squaredNorm() * tet_volume_m3(now, t);
    }
    return sum_j;
  };
  const Vec3 p0 = momentum(volume);
  const double e0 = energy(volume);
  cut(volume, sheet(volume.vertex(20).position_world_m + Vec3(0.003, 0.001, 0.002), Vec3(1, 0.1, 0), Vec3(0, 1, 0.3)),
      kExact);
  EXPECT_EQ(part_volumes(volume.mesh()).size(), 2u);
  EXPECT_LT((momentum(volume) - p0).norm(), 1e-10 * p0.norm());
  EXPECT_NEAR(energy(volume), e0, 1e-9 * e0);
}

TEST(TetCut, followed_from_where_it_begins_it_is_the_same_cut) {
  TetTopology everywhere(off_planes(4)), followed(off_planes(4));
  const CutSheet half = sheet(kMiddle + Vec3(0.02, 0, 0), Vec3(0.025, 0, 0), Vec3(0, 1, 0.1));
  const TetCutOutcome all = cut(everywhere, half, {});
  std::uint32_t begin = kNone;
  for (std::uint32_t t = 0; t < followed.tetrahedra().size() && begin == kNone; ++t) {
    TetTopology trial = followed;
    if (cut(trial, half, {}, std::array{t}).crossed > 0) begin = t;
  }
  ASSERT_NE(begin, kNone);
  EXPECT_EQ(cut(followed, half, {}, std::array{begin}).crossed, all.crossed);
  EXPECT_TRUE(same(everywhere, followed));
}

}  // namespace
}  // namespace sectio::tets_test
