// The kernel against a plain loop over edges in double precision, and against itself in another layout.
#include <gtest/gtest.h>

#include <cstring>

#include "sim_server/deformation/spring_kernel.h"
#include "tests/support/random.h"
#include "tests/unit/deformation/shapes.h"

namespace sectio::deformation_test {
namespace {

using test::Particles;

void shake(Particles& p, test::Random& random, float length_m, float speed) {
  std::uniform_real_distribution<float> unit(-1, 1);
  for (Vec4f& x : p.x) x.head<3>() += length_m * Vec3f(unit(random), unit(random), unit(random));
  for (Vec4f& v : p.v) v.head<3>() += speed * Vec3f(unit(random), unit(random), unit(random));
}

// An independent implementation of the equation of surface_springs.h, from the mesh alone.
std::vector<Vec3> plain_velocities(const TriangleMesh& mesh, const Particles& p, const SurfaceSpringMaterial& m,
                                   const SurfaceSpringSettings& s) {
  std::vector<double> area(mesh.vertex_slots(), 0);
  std::vector<Vec3> outward(mesh.vertex_slots(), Vec3::Zero()), pull(mesh.vertex_slots(), Vec3::Zero());
  std::map<std::pair<VertexId, VertexId>, double> edge_area;
  for (const Triangle& t : mesh.triangles()) {
    const Vec3 e = mesh.rest_body_m(t.v[1]) - mesh.rest_body_m(t.v[0]);
    const Vec3 normal = 0.5 * e.cross(mesh.rest_body_m(t.v[2]) - mesh.rest_body_m(t.v[0]));
    const double a = normal.norm();
    for (std::size_t i = 0; i < 3; ++i) {
      area[t.v[i]] += a / 3;
      outward[t.v[i]] += normal;
      edge_area[std::minmax(t.v[i], t.v[(i + 1) % 3])] += a;
    }
  }
  std::vector<Vec3> force(mesh.vertex_slots(), Vec3::Zero());
  for (const auto& [edge, a] : edge_area) {
    const auto [i, j] = edge;
    const double l_rest = (mesh.rest_body_m(i) - mesh.rest_body_m(j)).norm();
    const double k = m.young_pa * m.skin_thickness_m * a / (l_rest * l_rest);
    const Vec3 d_rest = mesh.rest_body_m(j) - mesh.rest_body_m(i), d = p.at(j) - p.at(i);
    pull[i] += k * m.pretension * d_rest;
    pull[j] -= k * m.pretension * d_rest;
    const Vec3 f = k * (1 - (1 - m.pretension) * l_rest / d.norm()) * d;
    force[i] += f;
    force[j] -= f;
  }
  const double k_w = 2 * m.young_pa / (1 - m.poisson * m.poisson) / (M_PI * m.foundation_radius_m);
  std::vector<Vec3> result;
  for (VertexId i = 0; i < mesh.vertex_slots(); ++i) {
    const double mass = m.density_kg_per_m3 * area[i] * m.foundation_radius_m;
    const Vec3 v = p.v[i].head<3>().cast<double>();
    const Vec3 n = outward[i].normalized(), held = -pull[i].dot(n) * n - mass * s.gravity_m_per_s2;
    const Vec3 f = force[i] + held + k_w * area[i] * (mesh.rest_body_m(i) - p.at(i)) - m.damping_per_s * mass * v;
    result.push_back(v + s.step_s * (f / mass + s.gravity_m_per_s2));
  }
  return result;
}

TEST(SpringKernel, agrees_with_the_plain_loop_to_float_accuracy) {
  const TriangleMesh mesh = test::organ();
  const SurfaceSpringMaterial material;
  const SurfaceSpringSettings settings;
  SurfaceSprings springs(mesh, {}, material, settings);
  Particles p(mesh, {});
  test::Random random(1);
  shake(p, random, 0.0005f, 0.1f);
  const std::vector<Vec3> expected = plain_velocities(mesh, p, material, settings);
  const Particles before = p;
  springs.step(p.x, p.v);
  double scale = 0;
  for (VertexId i = 0; i < mesh.vertex_slots(); ++i) {
    scale = std::max(scale, (expected[i] - before.v[i].head<3>().cast<double>()).norm());
  }
  for (VertexId i = 0; i < mesh.vertex_slots(); ++i) {
    EXPECT_LT((p.v[i].head<3>().cast<double>() - expected[i]).norm(), 2e-5 * scale) << i;
    EXPECT_LT((p.at(i) - before.at(i) - settings.step_s * expected[i]).norm(), 1e-7) << i;
    EXPECT_EQ(p.v[i].w(), 0);
    EXPECT_EQ(p.x[i].w(), 0);
  }
}

TEST(SpringKernel, does_not_depend_on_the_layout) {
  const TriangleMesh mesh = test::organ();
  SurfaceSprings springs(mesh, {}, {}, {});
  SpringRows spread = springs.rows();  // the same rows, half of them through overflow slices
  std::vector<HalfEdge> half_edges;
  for (VertexId v = 0; v < mesh.vertex_slots(); v += 2) {
    const VertexRow row = spread.row(v);
    half_edges.clear();
    for (std::uint32_t n = 0; n < spread.degree(v); ++n) half_edges.push_back(spread.half_edge(v, n));
    spread.remove(v);
    spread.set(v, row, half_edges);
  }
  ASSERT_GT(spread.overflow_row_count(), 200u);
  Particles a(mesh, {});
  test::Random random(2);
  shake(a, random, 0.0005f, 0.1f);
  Particles b = a;
  const VelocityUpdate update{0.975f, Vec3f(0, 0, -0.00981f), 5.0f};
  update_velocities(springs.rows(), update, a.x, a.v);
  update_velocities(spread, update, b.x, b.v);
  EXPECT_EQ(a.v, b.v);
}

TEST(SpringKernel, cuts_speed_back_and_counts) {
  const TriangleMesh mesh = test::organ(1);
  SurfaceSprings springs(mesh, {}, {}, test::no_gravity());
  Particles p(mesh, {});
  p.run(springs, 10);
  EXPECT_EQ(springs.clamped(), 0u);
  p.v[7].head<3>() = Vec3f(300, 400, 0);
  springs.step(p.x, p.v);
  EXPECT_EQ(springs.clamped(), 1u);
  EXPECT_NEAR(p.v[7].norm(), 2, 1e-3);
  EXPECT_EQ(springs.first_bad_vertex(), kNone);
}

// The pull alone would make the vertex faster than the cap within a step.
TEST(SpringKernel, an_instrument_feels_all_of_the_pull_of_a_vertex_that_it_holds) {
  const TriangleMesh mesh = test::organ(1);
  SurfaceSprings springs(mesh, {}, {}, test::no_gravity());
  Particles p(mesh, {});
  const Vec3 to = p.x[7].head<3>().cast<double>() + Vec3(0, 0, 0.08);
  const PointConstraint held = hold(7, to);
  Reaction reaction;
  for (int n = 0; n < 300; ++n) springs.step(p.x, p.v, {&held, 1}, {&reaction, 1});
  const std::vector<Vec4f> still(p.v.size(), Vec4f::Zero());
  Vec3 pull_n;
  for (int axis = 0; axis < 3; ++axis) {
    const auto energy_j = [&](float by_m) {
      std::vector<Vec4f> x = p.x;
      x[7][axis] += by_m;
      return springs.energy_j(x, still);
    };
    pull_n[axis] = -(energy_j(1e-4f) - energy_j(-1e-4f)) / 2e-4;
  }
  EXPECT_GT(pull_n.norm() * 0.001, 5 * springs.mass_kg(7));
  EXPECT_LT((reaction.force_on_tool_n - pull_n).norm(), 0.02 * pull_n.norm()) << reaction.force_on_tool_n.transpose();
}

TEST(SpringKernel, names_a_vertex_that_is_not_finite_and_stays_finite) {
  const TriangleMesh mesh = test::organ(1);
  SurfaceSprings springs(mesh, {}, {}, test::no_gravity());
  Particles p(mesh, {});
  p.v[11].y() = std::numeric_limits<float>::quiet_NaN();
  p.run(springs, 3);
  EXPECT_EQ(springs.first_bad_vertex(), 11u);
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) EXPECT_TRUE(p.x[v].allFinite() && p.v[v].allFinite()) << v;
}

// Random rows: degrees 0 to 11 (slices of all widths, padding, a last one not full), held vertices, all over memory.
SpringRows random_rows(test::Random& random, std::uint32_t vertices) {
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<std::uint32_t> degrees(vertices);
  for (std::uint32_t& d : degrees) d = random() % 8 == 0 ? kNone : static_cast<std::uint32_t>(random() % 12);
  SpringRows rows;
  rows.layout(degrees);
  for (VertexId v = 0; v < vertices; ++v) {
    if (degrees[v] == kNone) continue;
    std::vector<HalfEdge> half_edges(degrees[v]);
    for (HalfEdge& e : half_edges) e = {static_cast<VertexId>(random() % vertices), 50 * unit(random), unit(random)};
    const Vec3f home(unit(random), unit(random), unit(random));
    rows.set(v, {home, unit(random), random() % 9 == 0 ? 0.0f : 0.1f * unit(random), unit(random)}, half_edges);
  }
  return rows;
}

bool same_bits(const std::vector<Vec4f>& a, const std::vector<Vec4f>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Vec4f)) == 0;
}

TEST(SpringKernel, registers_of_8_and_of_16_lanes_give_the_same_bits) {
  if (!has_avx512()) GTEST_SKIP() << "this processor has no AVX-512";
  test::Random random(5);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::uint32_t clamped = 0, bad = 0;
  for (int network = 0; network < 200; ++network) {
    const std::uint32_t vertices = 1 + static_cast<std::uint32_t>(random() % 700);
    const SpringRows rows = random_rows(random, vertices);
    std::vector<Vec4f> x(vertices, Vec4f::Zero()), v8(vertices, Vec4f::Zero());
    for (Vec4f& p : x) p.head<3>() = Vec3f(unit(random), unit(random), unit(random));
    for (Vec4f& p : v8) p.head<3>() = Vec3f(unit(random), unit(random), unit(random));
    if (network % 2 == 1) {  // infinities and NaNs in neighbours, and in the vertex's own position or velocity
      x[random() % vertices].y() = std::numeric_limits<float>::infinity();
      v8[random() % vertices].z() = std::numeric_limits<float>::quiet_NaN();
      x[random() % vertices].x() = 1e30f;
    }
    std::vector<Vec4f> v16 = v8;
    const VelocityUpdate update{0.975f, Vec3f(0.001f, 0.002f, -0.00981f), 3.0f};
    const VelocityOutcome a = update_velocities(rows, update, x, v8, SimdWidth::eight);
    const VelocityOutcome b = update_velocities(rows, update, x, v16, SimdWidth::sixteen);
    ASSERT_TRUE(same_bits(v8, v16)) << network;
    ASSERT_EQ(a.clamped, b.clamped);
    ASSERT_EQ(a.not_finite, b.not_finite);
    clamped += a.clamped;
    bad += a.not_finite != kNone;
  }
  EXPECT_GT(clamped, 1000u);
  EXPECT_GT(bad, 50u);
}

}  // namespace
}  // namespace sectio::deformation_test
