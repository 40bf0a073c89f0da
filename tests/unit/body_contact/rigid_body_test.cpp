#include "sim_server/body_contact/contact_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "sim_server/body_contact/find_floor.h"

namespace sectio::test {
namespace {

constexpr double kStep_s = 0.001;
const Vec3 kGravity(0, 0, -9.81);
const Vec3 kBox_m(0.04, 0.03, 0.02);

// A box of water, and its corners.
RigidBody box_at(const Vec3& centre, const Vec3& size = kBox_m) {
  const double mass = 1000 * size.prod();
  const Vec3 s2 = size.cwiseProduct(size);
  return {mass, Mat3(Vec3(s2.y() + s2.z(), s2.x() + s2.z(), s2.x() + s2.y()).asDiagonal()) * mass / 12, centre};
}
std::vector<Vec3f> corners(const RigidBody& body, const Vec3& size = kBox_m) {
  std::vector<Vec3f> result;
  for (int i = 0; i < 8; ++i)
    result.push_back(body.pose_world()
                         .to_world(0.5 * size.cwiseProduct(Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)))
                         .cast<float>());
  return result;
}
double lowest(const RigidBody& body) {
  double z = 1e9;
  for (const Vec3f& p : corners(body)) z = std::min(z, double(p.z()));
  return z;
}

void solve(RigidBody& body, std::span<const BodyContact> contacts) {
  const ContactBody only{&body};
  ContactSolver solver({&only, 1}, contacts, kStep_s);
  solver.solve(30);
  solver.undo_depths(10);
}

// A floor at z = 0.
void step_on_floor(RigidBody& body, double friction) {
  if (body.asleep()) return;
  body.push(kGravity, kStep_s);
  std::vector<BodyContact> contacts;
  find_floor_contacts(corners(body), 0, 0.001 + 2 * kStep_s * body.velocity_m_per_s().norm(), 0, contacts);
  for (BodyContact& c : contacts) c.friction = friction;
  solve(body, contacts);
  body.move(kStep_s);
  body.rest(!contacts.empty(), 0.03, kStep_s);
}

TEST(RigidBody, free_fall_is_the_parabola) {
  RigidBody body = box_at(Vec3(1, 2, 3));
  body.set_velocity(Vec3(0.5, -0.25, 2), Vec3::Zero());
  for (int i = 0; i < 1000; ++i) {
    body.push(kGravity, kStep_s);
    body.move(kStep_s);
  }
  EXPECT_LT((body.pose_world().position_m - (Vec3(1.5, 1.75, 5) + 0.5 * kGravity)).norm(), 1e-11);
}

double energy_drift(double step_s) {
  RigidBody body = box_at(Vec3::Zero());
  body.set_velocity(Vec3::Zero(), Vec3(3, 8, -5));
  const Vec3 spin = body.angular_momentum_kg_m2_per_s();
  const double energy = body.kinetic_energy_j();
  double worst = 0;
  for (double t = 0; t < 2; t += step_s) {
    body.push(Vec3::Zero(), step_s);
    body.move(step_s);
    worst = std::max(worst, std::abs(body.kinetic_energy_j() / energy - 1));
  }
  EXPECT_EQ(spin, body.angular_momentum_kg_m2_per_s()) << "nothing acts on it";
  return worst;
}

TEST(RigidBody, tumbling_keeps_angular_momentum_to_the_bit_and_energy_to_the_step_squared) {
  const double fine = energy_drift(0.001), coarse = energy_drift(0.002);
  EXPECT_LT(fine, 2e-3);
  EXPECT_GT(fine, 0) << "the gyroscopic term acts";
  EXPECT_GT(coarse / fine, 3);
}

TEST(RigidBody, turns_about_the_largest_and_the_least_axis_but_flips_about_the_middle_one) {
  const auto least_along_start = [](int axis) {
    RigidBody body = box_at(Vec3::Zero());
    body.set_velocity(Vec3::Zero(), 10 * Vec3::Unit(axis) + Vec3::Constant(0.01));
    double least = 1;
    for (int i = 0; i < 5000; ++i) {
      body.push(Vec3::Zero(), kStep_s);
      body.move(kStep_s);
      least = std::min(least, (body.pose_world().orientation * Vec3::Unit(axis)).dot(Vec3::Unit(axis)));
    }
    return least;
  };
  EXPECT_GT(least_along_start(0), 0.99);
  EXPECT_LT(least_along_start(1), -0.9) << "intermediate axis (Dzhanibekov)";
  EXPECT_GT(least_along_start(2), 0.99);
}

TEST(RigidBody, impulse_changes_both_momenta_by_itself) {
  RigidBody body = box_at(Vec3(1, 0, 0));
  body.add_impulse(Vec3(0, 2, 0), Vec3(1.5, 0, 0));
  EXPECT_EQ(body.momentum_kg_m_per_s(), Vec3(0, 2, 0));
  EXPECT_EQ(body.angular_momentum_kg_m2_per_s(), Vec3(0, 0, 1));
}

TEST(RigidBody, dropped_on_an_edge_it_comes_to_rest_flat_and_sleeps) {
  RigidBody body = box_at(Vec3(0, 0, 0.08));
  body.set_velocity(Vec3(0.1, 0, 0), Vec3(2, 3, 1));
  double deepest = 0;
  int steps = 0;
  for (; steps < 5000 && !body.asleep(); ++steps) {
    step_on_floor(body, 0.5);
    deepest = std::max(deepest, -lowest(body));
  }
  EXPECT_TRUE(body.asleep());
  EXPECT_LT(deepest, 5e-4) << "it doesn't sink";
  const Mat3 r = body.pose_world().orientation.toRotationMatrix();
  EXPECT_GT(r.row(2).cwiseAbs().maxCoeff(), 0.99999) << "on a face";
  EXPECT_NEAR(lowest(body), 0, 1.5e-4);
  const Vec3 at = body.pose_world().position_m;
  step_on_floor(body, 0.5);
  EXPECT_EQ(at, body.pose_world().position_m);
}

TEST(RigidBody, energy_never_grows_on_the_floor) {
  RigidBody body = box_at(Vec3(0, 0, 0.08));
  body.set_velocity(Vec3(0.4, 0.2, 0), Vec3(8, -5, 3));
  const auto energy = [&] {
    return body.kinetic_energy_j() - body.mass_kg() * kGravity.dot(body.pose_world().position_m);
  };
  const double start = energy();
  double least = start;
  for (int i = 0; i < 3000; ++i) {
    step_on_floor(body, 0.3);
    EXPECT_LT(energy(), least + 0.01 * start) << i;
    least = std::min(least, energy());
  }
}

// The face of a piece that was bent when it came off: many points, 0.2 mm lower in the middle.
TEST(RigidBody, on_a_bulging_face_it_comes_to_rest_and_does_not_creep) {
  std::vector<Vec3> face_m;
  for (int i = -20; i <= 20; ++i)
    for (int k = -10; k <= 10; ++k) {
      const double x = 0.001 * i, y = 0.001 * k;
      face_m.emplace_back(x, y, -0.01 - 2e-4 * (1 - x * x / 4e-4) - 1e-5 * ((7 * i + 3 * k) % 5));
    }
  RigidBody body = box_at(Vec3(0, 0, 0.0115));
  body.set_velocity(Vec3(0.05, 0.02, 0), Vec3(0.5, 0, 0.2));
  int steps = 0;
  for (; steps < 1500 && !body.asleep(); ++steps) {
    body.push(kGravity, kStep_s);
    std::vector<Vec3f> points;
    for (const Vec3& p : face_m) points.push_back(body.pose_world().to_world(p).cast<float>());
    std::vector<BodyContact> contacts;
    find_floor_contacts(points, 0, 2e-4 + 2 * kStep_s * body.velocity_m_per_s().norm(), 0, contacts);
    solve(body, contacts);
    body.move(kStep_s);
    body.rest(!contacts.empty(), 0.025, kStep_s);
  }
  EXPECT_LT(steps, 1500);
}

class Sliding : public testing::TestWithParam<double> {};
TEST_P(Sliding, stops_after_v_squared_over_two_mu_g) {
  const double friction = GetParam(), speed = 0.5;
  RigidBody body = box_at(Vec3(0, 0, 0.5 * kBox_m.z()));
  body.set_velocity(Vec3(speed, 0, 0), Vec3::Zero());
  for (int i = 0; i < 3000 && !body.asleep(); ++i) step_on_floor(body, friction);
  EXPECT_TRUE(body.asleep());
  const double distance = speed * speed / (2 * friction * 9.81);
  EXPECT_NEAR(body.pose_world().position_m.x(), distance, 0.03 * distance);
  EXPECT_NEAR(body.pose_world().position_m.y(), 0, 0.01 * distance);
}
INSTANTIATE_TEST_SUITE_P(Friction, Sliding, testing::Values(0.1, 0.2, 0.4));

TEST(RigidBody, without_friction_it_slides_on) {
  RigidBody body = box_at(Vec3(0, 0, 0.5 * kBox_m.z()));
  body.set_velocity(Vec3(0.5, 0, 0), Vec3::Zero());
  for (int i = 0; i < 1000; ++i) step_on_floor(body, 0);
  EXPECT_NEAR(body.pose_world().position_m.x(), 0.5, 1e-4);
}

TEST(RigidBody, depth_is_undone_without_a_jump) {
  RigidBody body = box_at(Vec3(0, 0, 0.5 * kBox_m.z() - 0.002));
  double fastest = 0;
  for (int i = 0; i < 300; ++i) {
    step_on_floor(body, 0.3);
    fastest = std::max(fastest, body.velocity_m_per_s().norm());
  }
  EXPECT_NEAR(lowest(body), 0, 1e-4);
  EXPECT_LT(fastest, 0.011) << "no faster than a step of gravity makes it";
}

TEST(RigidBody, two_bodies_that_meet_keep_their_momentum) {
  RigidBody a = box_at(Vec3::Zero()), b = box_at(Vec3(0.04, 0.01, 0), Vec3(0.04, 0.04, 0.04));
  a.set_velocity(Vec3(1, 0, 0), Vec3(0, 0, 3));
  b.set_velocity(Vec3(-0.5, 0.1, 0), Vec3(1, 0, 0));
  const auto spin_about_origin = [](const RigidBody& x) -> Vec3 {
    return x.angular_momentum_kg_m2_per_s() + x.pose_world().position_m.cross(x.momentum_kg_m_per_s());
  };
  const Vec3 momentum = a.momentum_kg_m_per_s() + b.momentum_kg_m_per_s();
  const Vec3 spin = spin_about_origin(a) + spin_about_origin(b);
  BodyContact contact;
  contact.one.body = 0;
  contact.point_world_m = Vec3(0.02, 0.005, 0.003);
  contact.normal_world = Vec3(-1, 0.1, 0).normalized();
  contact.other.body = 1;
  const ContactBody bodies[] = {{&a}, {&b}};
  ContactSolver(bodies, {&contact, 1}, kStep_s).solve(30);
  EXPECT_LT((a.momentum_kg_m_per_s() + b.momentum_kg_m_per_s() - momentum).norm(), 1e-9 * momentum.norm());
  EXPECT_LT((spin_about_origin(a) + spin_about_origin(b) - spin).norm(), 1e-9 * spin.norm());
  EXPECT_NEAR((a.velocity_at(contact.point_world_m) - b.velocity_at(contact.point_world_m)).dot(contact.normal_world),
              0, 1e-6);
}

TEST(RigidBody, rigid_velocity_has_the_momenta_of_the_points) {
  std::vector<MovingPoint> points;
  Vec3 momentum = Vec3::Zero(), spin = Vec3::Zero();
  std::srand(7);
  for (int i = 0; i < 50; ++i) {
    points.push_back({Vec3::Random(), Vec3::Random(), 1 + 0.01 * i});
    momentum += points.back().mass_kg * points.back().velocity_m_per_s;
    spin += points.back().mass_kg * points.back().at_m.cross(points.back().velocity_m_per_s);
  }
  const RigidVelocity v = rigid_velocity(points);
  for (const MovingPoint& p : points) {
    momentum -= p.mass_kg * v.at(p.at_m);
    spin -= p.mass_kg * p.at_m.cross(v.at(p.at_m));
  }
  EXPECT_LT(momentum.norm(), 1e-12);
  EXPECT_LT(spin.norm(), 1e-12);
}

TEST(BodyContact, a_crowd_of_contacts_is_reduced_to_those_that_bear) {
  std::vector<Vec3f> points;
  for (int i = 0; i <= 20; ++i)
    for (int k = 0; k <= 20; ++k) points.emplace_back(0.01f * float(i), 0.01f * float(k), 0.f);
  points[220].z() = -1e-4f;
  std::vector<BodyContact> contacts;
  find_floor_contacts(points, 0, 1e-3, 0, contacts);
  EXPECT_LE(contacts.size(), 25u);
  EXPECT_GE(contacts.size(), 5u);
  for (const double x : {0.0, 0.2})
    for (const double y : {0.0, 0.2})
      EXPECT_TRUE(std::ranges::any_of(
          contacts, [&](const BodyContact& c) { return (c.point_world_m - Vec3(x, y, 0)).norm() < 1e-6; }));
  EXPECT_TRUE(std::ranges::any_of(contacts, [](const BodyContact& c) { return c.depth_m > 5e-5; })) << "the deepest";
}

// All weigh 1 g; some are fixed.
class SomeFixed : public DeformationEngine {
 public:
  explicit SomeFixed(std::vector<bool> fixed) : fixed_(std::move(fixed)) {}

  void follow(const SharedBody&, const TopologyChange&) override {}
  void step(const SharedBody&, std::span<const PointConstraint>, std::span<Reaction>) override {}
  void set_gravity(const Vec3&) override {}
  Pose rest_frame_world(VertexId) const override { return {}; }
  void release(std::span<const VertexId>, const std::optional<SupportPlane>&) override {}
  bool fixed(VertexId v) const override { return fixed_[v]; }
  double mass_kg(VertexId) const override { return 1e-3; }
  double energy_j(const SharedBody&) const override { return 0; }
  double largest_stable_step_s() const override { return 1; }
  VertexId first_bad_vertex() const override { return kNone; }

 private:
  std::vector<bool> fixed_;
};

// The vertex lies over a fixed corner of a triangle. A free corner has this weight, by rounding when it is little.
double gained_m_per_s(double weight) {
  const SomeFixed particles({true, true, true, false});
  const std::vector<Vec4f> x(4, Vec4f(Vec4f::Zero())), v{Vec4f(0, 0, -0.01f, 0), x[0], x[0], x[0]};
  const ContactBody body{nullptr, {x, v}, &particles};
  BodyContact contact;
  contact.depth_m = 0.01 * kStep_s;  // it was at the surface before this step
  contact.one = side_at(0, 0);
  contact.other = {0, {1, 2, 3}, Vec3(0.5 * (1 - weight), 0.5 * (1 - weight), weight)};
  ContactSolver solver({&body, 1}, {&contact, 1}, kStep_s);
  solver.solve(30);
  double most = 0;
  for (const NodeChange& c : solver.changes_of(0)) most = std::max(most, c.faster_by_m_per_s.norm());
  return most;
}

TEST(ContactOfFixedTissue, flings_no_free_corner_away) {
  EXPECT_NEAR(gained_m_per_s(1.0 / 3), 0.03, 1e-9);  // it gives way as far as it must
  for (double weight = 1e-12; weight < 1; weight *= 2) EXPECT_LE(gained_m_per_s(weight), 0.2 * (1 + 1e-9)) << weight;
  EXPECT_EQ(gained_m_per_s(1e-9), 0);
}

// Vertex 0 and the triangle of 1, 2 and 3 hang on the same two nodes, but for `apart` of their weights.
class OneCell final : public SomeFixed {
 public:
  explicit OneCell(double apart) : SomeFixed(std::vector<bool>(4, false)), apart_(apart) {}
  void nodes_of(VertexId v, std::vector<NodeShare>& nodes) const override {
    const double first = v == 0 ? 0.5 + apart_ : 0.5;
    nodes = {{0, first}, {1, 1 - first}};
  }

 private:
  double apart_;
};

TEST(ContactOfLips, does_not_hold_a_cell_stiff_that_both_hang_on) {
  for (double apart = 1e-9; apart < 0.5; apart *= 2) {
    const OneCell cell(apart);
    const std::vector<Vec4f> x(4, Vec4f(Vec4f::Zero())), v{x[0], Vec4f(0, 0, 1, 0), x[0], x[0]};
    const ContactBody body{nullptr, {x, v}, &cell};
    BodyContact contact;
    contact.depth_m = 1e-6;
    contact.one = side_at(0, 0);
    contact.other = {0, {1, 2, 3}, Vec3::Constant(1.0 / 3)};
    ContactSolver solver({&body, 1}, {&contact, 1}, kStep_s);
    solver.solve(30);
    const bool holds_apart = !solver.changes_of(0).empty();
    if (apart < 0.005) {
      EXPECT_FALSE(holds_apart) << apart;
    }
    if (apart > 0.02) {
      EXPECT_TRUE(holds_apart) << apart;
    }
  }
}

}  // namespace
}  // namespace sectio::test
