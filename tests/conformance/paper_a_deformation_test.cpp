// Paper A, section 2.2: deformation templates.
#include <gtest/gtest.h>

#include <random>

#include "sim_server/deformation/surface_springs.h"
#include "sim_server/surface/indentation/contact_templates.h"
#include "tests/support/knife_on_mesh.h"
#include "tests/support/random.h"

namespace sectio::test {
namespace {

using Kind = PathPoint::Kind;

// A pad that a probe presses on its upper side, at points of the original surface.
class PressedPad : public PadUnderKnife {
 public:
  // The original triangle at a point of the upper side: found on the mesh without temporary elements.
  ContactPoint inside(double x_m, double y_m, double depth_m = 0.001) const {
    const TriangleMesh original(soup);
    ContactPoint best;
    double most = -1e9;
    for (const Triangle& t : original.triangles()) {
      const Vec3 a = original.rest_body_m(t.v[0]), b = original.rest_body_m(t.v[1]), c = original.rest_body_m(t.v[2]);
      const Vec3 p(x_m, y_m, kTop_m);
      const double area = (b - a).cross(c - a).z();
      if (area < 1e-9 || a.z() < kTop_m - 1e-9) continue;
      const Vec3 bary((b - p).cross(c - p).z() / area, (c - p).cross(a - p).z() / area,
                      (a - p).cross(b - p).z() / area);
      if (bary.minCoeff() <= most) continue;
      most = bary.minCoeff();
      best.place.kind = Kind::in_face;
      best.place.face = t.v;
      best.place.bary = bary;
    }
    best.target_world_m = Vec3(x_m, y_m, kTop_m - depth_m);
    return best;
  }
  // On the edge that ends at corners closest to two points.
  ContactPoint on_edge(const Vec3& from, const Vec3& to, double t, double depth_m = 0.001) const {
    ContactPoint p;
    p.place.kind = Kind::on_edge;
    p.place.from = vertex_at(from);
    p.place.to = vertex_at(to);
    p.place.t = t;
    p.target_world_m = from + t * (to - from) - depth_m * Vec3::UnitZ();
    return p;
  }
  VertexId vertex_at(const Vec3& place) const {
    for (VertexId v = 0; v < soup.vertices_body_m.size(); ++v)
      if ((soup.vertices_body_m[v] - place).norm() < 1e-9) return v;
    return kNone;
  }
  Press touch(const std::vector<ContactPoint>& points) {
    MeshDraft draft(mesh, view());
    const Press p = press(draft, contact, points, {});
    EXPECT_TRUE(commit(draft));
    EXPECT_TRUE(valid());
    return p;
  }
  bool let_go() {
    MeshDraft draft(mesh, view());
    return release(draft, contact) && commit(draft) && valid();
  }
  // Edges with both ends in the face's triangles and none on its rim: springs within.
  int inner_springs(const std::vector<Triangle>& of) const {
    std::map<std::pair<VertexId, VertexId>, int> edges;
    for (const Triangle& t : of)
      for (std::size_t i = 0; i < 3; ++i) ++edges[std::minmax(t.v[i], t.v[(i + 1) % 3])];
    int inner = 0;
    for (const auto& [edge, count] : edges) inner += count == 2;
    return inner;
  }
  double least_area_m2() const {
    double least = 1;
    for (const Triangle& t : mesh.triangles())
      if (t.alive()) least = std::min(least, (x(t.v[1]) - x(t.v[0])).cross(x(t.v[2]) - x(t.v[0])).norm() / 2);
    return least;
  }

  const TriangleSoup soup = box(6, 4, 2, Vec3(0.06, 0.04, kTop_m));
  TemporaryContact contact;
};

// The face above the diagonal of cell 1, 1: corners A (10, 20), B (10, 10), C (20, 20) mm; its diagonal is B C.
const Vec3 kA(0.010, 0.020, 0.02), kB(0.010, 0.010, 0.02), kC(0.020, 0.020, 0.02);

TEST(A_DEF, A_DEF_0_no_original_particle_is_moved) {
  PressedPad pad;
  const std::vector<Vec4f> before = pad.particles.position_world_m;
  const std::uint32_t old_vertices = pad.mesh.vertex_slots();
  const Press p = pad.touch({pad.on_edge(kB, kC, 0.4), pad.inside(0.012, 0.017)});
  ASSERT_EQ(p.held.size(), 2u);
  for (const HeldParticle& held : p.held) {
    EXPECT_GE(held.vertex, old_vertices);
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(pad.particles.position_world_m[held.vertex][i], held.target_world_m[i], 1e-8);
    EXPECT_NEAR(pad.x(held.vertex).z(), pad.kTop_m, 1e-9) << "at rest on the undeformed face";
  }
  for (VertexId v = 0; v < old_vertices; ++v) {
    EXPECT_EQ(pad.x(v), pad.soup.vertices_body_m[v]);
    EXPECT_EQ(pad.particles.position_world_m[v], before[v]);
  }
}

TEST(A_DEF, A_DEF_1_one_active_edge) {
  PressedPad pad;
  pad.touch({pad.on_edge(kB, kC, 0.4), pad.inside(0.012, 0.017)});
  const ContactTemplate& t = contact_template_for(1, 1, false);
  const auto faces = pad.upper(1, 1, true);
  EXPECT_EQ(faces.size(), 4u);
  EXPECT_EQ(t.triangles, 4);
  EXPECT_EQ(pad.inner_springs(faces), 4);
  EXPECT_EQ(t.springs, 4);
  EXPECT_EQ(pad.mesh.vertex_count(), pad.soup.vertices_body_m.size() + 2);
  const MeshDraft reader(pad.mesh, pad.view());
  const VertexId e = pad.contact.particles[0], k = pad.contact.particles[1];
  EXPECT_EQ(reader.triangle_of_edge(pad.vertex_at(kB), pad.vertex_at(kC)), kNone) << "the active edge is two";
  for (const VertexId end : {pad.vertex_at(kB), pad.vertex_at(kC)}) EXPECT_NE(reader.triangle_of_edge(e, end), kNone);
  for (const VertexId other : {pad.vertex_at(kA), pad.vertex_at(kB), pad.vertex_at(kC), e})
    EXPECT_NE(reader.triangle_of_edge(k, other), kNone) << "the central particle has a spring to each";
}

TEST(A_DEF, A_DEF_2_two_active_edges) {
  PressedPad pad;
  pad.touch({pad.on_edge(kB, kC, 0.4), pad.on_edge(kB, kA, 0.6)});
  const ContactTemplate& t = contact_template_for(2, 0, false);
  const auto faces = pad.upper(1, 1, true);
  EXPECT_EQ(faces.size(), 3u);
  EXPECT_EQ(t.triangles, 3);
  EXPECT_EQ(pad.inner_springs(faces), 2);
  EXPECT_EQ(t.springs, 2);
  EXPECT_EQ(2 * t.halved, 4) << "the four that the text names";
}

TEST(A_DEF, A_DEF_3_particle_in_the_face_coincides_with_the_one_on_the_edge) {
  PressedPad pad;
  pad.touch({pad.on_edge(kB, kC, 0.4), pad.inside(0.0141, 0.0143)});
  EXPECT_EQ(pad.contact.particles.size(), 1u);
  EXPECT_EQ(pad.upper(1, 1, true).size(), std::size_t(contact_template_for(1, 1, true).triangles));
  EXPECT_GT(pad.least_area_m2(), 1e-7);
}

TEST(A_DEF, A_DEF_4_particles_on_both_edges_coincide_at_their_corner) {
  PressedPad pad;
  pad.touch({pad.on_edge(kB, kC, 0.001), pad.on_edge(kB, kA, 0.002)});
  EXPECT_EQ(pad.contact.particles.size(), 1u);
  EXPECT_EQ(pad.upper(1, 1, true).size(), std::size_t(contact_template_for(2, 0, true).triangles));
  EXPECT_GT(pad.least_area_m2(), 1e-7);
}

TEST(A_DEF, A_DEF_5_one_vertex_inside_a_face) {
  PressedPad pad;
  pad.touch({pad.inside(0.013, 0.017)});
  const auto faces = pad.upper(1, 1, true);
  const ContactTemplate& t = contact_template_for(0, 1, false);
  EXPECT_EQ(faces.size(), 3u);
  EXPECT_EQ(pad.inner_springs(faces), 3);
  EXPECT_EQ(t.particles, 1);
  EXPECT_EQ(t.springs, 3);
}

TEST(A_DEF, A_DEF_6_two_vertices_inside_a_face) {
  PressedPad pad;
  pad.touch({pad.inside(0.0115, 0.0185), pad.inside(0.0122, 0.0147)});
  const auto faces = pad.upper(1, 1, true);
  const ContactTemplate& t = contact_template_for(0, 2, false);
  EXPECT_EQ(faces.size(), 5u);
  EXPECT_EQ(pad.inner_springs(faces), 6);
  EXPECT_EQ(t.particles, 2);
  EXPECT_EQ(t.springs, 6);
}

TEST(A_DEF, A_DEF_7_what_is_replaced_is_inactive_and_not_deleted) {
  PressedPad pad;
  const TriangleMesh before = pad.mesh;
  pad.touch({pad.on_edge(kB, kC, 0.4), pad.inside(0.012, 0.017)});
  ASSERT_TRUE(pad.contact.inverse);
  std::size_t kept = 0;
  for (const TriangleEdit& e : pad.contact.inverse->triangles) {
    if (!e.triangle.alive()) continue;
    EXPECT_EQ(e.triangle, before.triangle(e.id));
    ++kept;
  }
  EXPECT_EQ(kept, 2u) << "the face and its neighbour over the active edge, each in its slot";
}

TEST(A_DEF, A_DEF_8_the_original_database_comes_back_bit_for_bit_on_replicas_too) {
  PressedPad pad;
  const TriangleMesh before = pad.mesh;
  TriangleMesh replica = before;
  const auto publish = [&](const MeshDraft& draft) {
    const TopologyDelta delta = draft.delta();
    ASSERT_EQ(apply(delta, replica), ApplyStatus::applied);
    ASSERT_TRUE(pad.commit(draft));
    ASSERT_EQ(replica.hash(), pad.mesh.hash());
  };
  for (const auto& points :
       std::vector<std::vector<ContactPoint>>{{pad.inside(0.013, 0.017)},
                                              {pad.inside(0.0115, 0.0185), pad.inside(0.0122, 0.0147)},
                                              {pad.on_edge(kB, kC, 0.4), pad.inside(0.012, 0.017)},
                                              {pad.on_edge(kB, kC, 0.4), pad.on_edge(kB, kA, 0.6)}}) {
    MeshDraft down(pad.mesh, pad.view());
    ASSERT_EQ(press(down, pad.contact, points, {}).change, ContactChange::exchanged);
    publish(down);
    EXPECT_FALSE(pad.mesh.same_database(before));
    MeshDraft up(pad.mesh, pad.view());
    ASSERT_TRUE(release(up, pad.contact));
    publish(up);
    EXPECT_TRUE(pad.mesh.same_database(before));
    EXPECT_TRUE(replica.same_database(before));
  }
}

// The permanently running engine: displace, hold, one step, release.
class PressedSprings : public PressedPad {
 public:
  PressedSprings() : springs(mesh, Pose{}, {}, spring_settings()) {}
  static SurfaceSpringSettings spring_settings() {
    SurfaceSpringSettings s;
    s.step_s = 2e-4;
    s.gravity_m_per_s2.setZero();
    return s;
  }
  void step(std::span<const HeldParticle> held) {
    std::vector<PointConstraint> constraints;
    for (const HeldParticle& p : held) constraints.push_back(hold(p.vertex, p.target_world_m));
    std::vector<Reaction> reactions(constraints.size());
    springs.step(particles.position_world_m, particles.velocity_world_m_per_s, constraints, reactions);
  }
  void topology_changed(const TopologyDelta& delta, const TriangleMesh& before) {
    std::set<VertexId> touched;
    for (const TriangleEdit& e : delta.triangles) {
      if (e.triangle.alive()) touched.insert(e.triangle.v.begin(), e.triangle.v.end());
      if (e.id < before.triangle_slots() && before.triangle(e.id).alive())
        touched.insert(before.triangle(e.id).v.begin(), before.triangle(e.id).v.end());
    }
    for (const VertexEdit& e : delta.vertices) touched.insert(e.id);
    const std::vector<VertexId> list(touched.begin(), touched.end());
    springs.update(mesh, list);
  }
  SurfaceSprings springs;
};

TEST(A_DEF, A_DEF_9_held_for_one_step_and_no_longer) {
  PressedSprings pad;
  MeshDraft draft(pad.mesh, pad.view());
  const TriangleMesh before = pad.mesh;
  const Press p = press(draft, pad.contact, std::vector{pad.inside(0.013, 0.017, 0.0005)}, {});
  const TopologyDelta delta = draft.delta();
  ASSERT_TRUE(pad.commit(draft));
  pad.topology_changed(delta, before);
  pad.step(p.held);
  const VertexId k = p.held[0].vertex;
  const auto depth = [&] { return pad.kTop_m - pad.particles.position_world_m[k].z(); };
  EXPECT_NEAR(depth(), 0.0005, 1e-5) << "held";
  for (int i = 0; i < 3000; ++i) pad.step({});
  EXPECT_LT(depth(), 1e-5) << "free: the springs have pulled it home";
}

TEST(A_DEF, A_DEF_10_contact_with_the_new_faces_adds_no_elements) {
  PressedPad pad;
  pad.touch({pad.inside(0.013, 0.017), pad.inside(0.0115, 0.0185)});
  const std::uint32_t vertices = pad.mesh.vertex_slots(), triangles = pad.mesh.triangle_slots();
  test::Random64 random(7);
  std::uniform_real_distribution<double> u(0, 1);
  int exchanged = 0;
  for (int i = 0; i < 10000; ++i) {
    // Wherever in the face: on one of the new triangles.
    MeshDraft draft(pad.mesh, pad.view());
    const double x = 0.011 + 0.003 * u(random), y = 0.0165 + 0.003 * u(random);
    const Press p = press(draft, pad.contact, std::vector{pad.inside(x, y), pad.inside(x + 0.001, y - 0.0012)}, {});
    exchanged += p.change != ContactChange::displaced;
    for (const HeldParticle& held : p.held) {
      EXPECT_LT((draft.position(held.vertex) - held.target_world_m).norm(), 1e-12);
    }
    ASSERT_TRUE(pad.commit(draft));
    ASSERT_EQ(pad.mesh.vertex_slots(), vertices);
    ASSERT_EQ(pad.mesh.triangle_slots(), triangles);
  }
  EXPECT_EQ(exchanged, 0);
  EXPECT_TRUE(pad.valid());
}

TEST(A_DEF, A_DEF_11_templates_are_exchanged_as_the_contact_changes_and_nothing_leaks) {
  PressedPad pad;
  const TriangleMesh before = pad.mesh;
  const std::vector<std::vector<ContactPoint>> stages{
      {pad.inside(0.012, 0.017)},
      {pad.inside(0.012, 0.017), pad.inside(0.0115, 0.0145)},
      {pad.on_edge(kB, kC, 0.4), pad.inside(0.012, 0.017)},
      {pad.on_edge(kB, kC, 0.4), pad.on_edge(kB, kA, 0.6)},
      {pad.on_edge(kA, kC, 0.4), pad.on_edge(kB, kC, 0.5), pad.inside(0.018, 0.013)},
  };
  const std::vector<std::size_t> particles{1, 2, 2, 2, 3};
  std::uint32_t most = 0;
  for (int round = 0; round < 200; ++round)
    for (std::size_t i = 0; i < stages.size(); ++i) {
      const Press p = pad.touch(stages[(i * 3 + std::size_t(round)) % stages.size()]);
      EXPECT_EQ(p.change, round + int(i) == 0 || stages.size() > 1 ? ContactChange::exchanged : p.change);
      EXPECT_EQ(p.held.size(), particles[(i * 3 + std::size_t(round)) % stages.size()]);
      EXPECT_EQ(pad.mesh.vertex_count(), before.vertex_count() + p.held.size());
      most = std::max(most, pad.mesh.triangle_slots());
    }
  EXPECT_LE(most, before.triangle_slots() + 6);
  ASSERT_TRUE(pad.let_go());
  EXPECT_TRUE(pad.mesh.same_database(before));
}

// The instrument is a line that leans: 1 mm deep at one end, 3 mm at the other, within one face.
TEST(A_DEF, A_DEF_12_closer_to_the_instrument_than_moving_original_points) {
  const Vec3 from(0.0115, 0.0185, 0.019), to(0.0125, 0.0145, 0.017);
  const auto gap_m = [&](const PadUnderKnife& pad) {  // from the instrument down to the surface, at most
    double most = 0;
    for (int i = 0; i <= 50; ++i) {
      const Vec3 p = from + i / 50.0 * (to - from);
      double height = -1;
      for (const Triangle& t : pad.mesh.triangles()) {
        if (!t.alive()) continue;
        const ParticleView at = pad.view();
        const Vec3 a = at.position(t.v[0]), b = at.position(t.v[1]), c = at.position(t.v[2]);
        const double area = (b - a).cross(c - a).z();
        if (area < 1e-12) continue;
        const double u = (b - p).cross(c - p).z() / area, v = (c - p).cross(a - p).z() / area, w = 1 - u - v;
        if (u > -1e-9 && v > -1e-9 && w > -1e-9) height = std::max(height, u * a.z() + v * b.z() + w * c.z());
      }
      most = std::max(most, std::abs(p.z() - height));
    }
    return most;
  };
  PressedPad old_way;
  const ContactPoint inside = old_way.inside(from.x(), from.y());
  for (const VertexId v : inside.place.face) old_way.particles.position_world_m[v].z() = static_cast<float>(to.z());
  PressedPad pad;
  ContactPoint a = pad.inside(from.x(), from.y()), b = pad.inside(to.x(), to.y());
  a.target_world_m = from;
  b.target_world_m = to;
  pad.touch({a, b});
  std::printf("gap: %.3f mm with original points moved, %.3f mm with new ones\n", 1e3 * gap_m(old_way),
              1e3 * gap_m(pad));
  EXPECT_GT(gap_m(old_way), 1.9e-3);
  EXPECT_LT(gap_m(pad), 1e-5);
}

TEST(A_DEF, A_DEF_13_deformation_alone_leaves_no_permanent_change) {
  PressedPad pad;
  const TriangleMesh before = pad.mesh;
  test::Random64 random(11);
  std::uniform_real_distribution<double> u(0, 1);
  for (int i = 0; i < 2000; ++i) {
    if (u(random) < 0.2) {
      ASSERT_TRUE(pad.let_go());
      ASSERT_TRUE(pad.mesh.same_database(before));
      continue;
    }
    std::vector<ContactPoint> points;
    for (int k = 0; k < 3; ++k) {
      const double x = 0.001 + 0.058 * u(random), y = 0.001 + 0.038 * u(random);
      if (u(random) < 0.5) {
        points.push_back(pad.inside(x, y));
      } else {
        const Vec3 corner(0.01 * std::floor(100 * x), 0.01 * std::floor(100 * y), 0.02);
        points.push_back(pad.on_edge(corner, corner + Vec3(0.01, 0.01, 0), u(random)));
      }
    }
    MeshDraft draft(pad.mesh, pad.view());
    const Press p = press(draft, pad.contact, points, {});
    EXPECT_NE(p.change, ContactChange::refused);
    ASSERT_TRUE(pad.commit(draft));
    ASSERT_TRUE(pad.valid());
    EXPECT_TRUE(pad.contact.inverse) << "a temporary change always has its inverse";
  }
  ASSERT_TRUE(pad.let_go());
  EXPECT_TRUE(pad.mesh.same_database(before));
}

}  // namespace
}  // namespace sectio::test
