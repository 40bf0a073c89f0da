#include "sim_server/body_contact/rigid_motion.h"

#include <Eigen/LU>
#include <algorithm>

#include "sim_server/body_contact/mass_properties.h"

namespace sectio {
namespace {

constexpr double kHeldFollows = 0.5;     // share of the way to where a held point should be, in one step
constexpr double kGripDamps_s = 0.004;   // a spring's damping over its stiffness
constexpr double kCrushed = 0.8;         // share of the volume at rest, or that of the present volume
constexpr double kLargestForce_n = 1e6;  // a constraint that names none has this

Vec3 point_of(const PointConstraint& constraint, const ParticleView& now) {
  if (constraint.v[0] == kNone) return constraint.point_world_m;
  Vec3 point = Vec3::Zero();
  for (std::size_t a = 0; a < 3; ++a)
    if (constraint.v[a] != kNone) point += constraint.w[a] * now.position(constraint.v[a]);
  return point;
}

BodyContact contact_of(const PointConstraint& constraint, const ParticleView& now, double step_s, double friction) {
  BodyContact c;
  c.point_world_m = point_of(constraint, now);
  if (!constraint.unilateral) {
    const Vec3 lag_m = constraint.target_world_m - c.point_world_m;
    const double a = constraint.compliance_m_per_n;
    c.surface_velocity_m_per_s = a > 0 ? Vec3(lag_m / (kGripDamps_s + step_s)) : Vec3(kHeldFollows / step_s * lag_m);
    c.grip_softness_per_kg = a / (step_s * (kGripDamps_s + step_s));
    c.grip_n = std::min(constraint.largest_force_n, kLargestForce_n);
    return c;
  }
  c.normal_world = -constraint.normal;
  c.depth_m = (c.point_world_m - constraint.target_world_m).dot(constraint.normal);
  c.surface_velocity_m_per_s = constraint.target_velocity_m_per_s;
  c.largest_speed_m_per_s = kFastestHand_m_per_s;
  c.friction = friction;
  return c;
}

// A part that a blade has crushed on its way out would stay crushed for good.
bool is_crushed(double now_m3, double rest_m3) {
  return now_m3 < kCrushed * rest_m3 || now_m3 > rest_m3 / kCrushed;
}

// Around the same middle.
void take_rest_shape(const TriangleMesh& mesh, const Pose& frame_world, std::vector<Vec3>& now_world_m) {
  Vec3 way_m = Vec3::Zero();
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v)
    if (mesh.vertex_alive(v)) way_m += now_world_m[v] - frame_world.to_world(mesh.rest_body_m(v));
  way_m /= mesh.vertex_count();
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) now_world_m[v] = frame_world.to_world(mesh.rest_body_m(v)) + way_m;
}

}  // namespace

std::unique_ptr<RigidMotion> RigidMotion::release(const SharedBody& part, const Pose& frame_world,
                                                  std::span<const double> mass_kg, const RigidSettings& settings) {
  const TriangleMesh& mesh = part.mesh;
  const ParticleView state = part.particles.view();
  std::vector<Vec3> now;
  std::vector<MovingPoint> points;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    now.push_back(state.position(v));
    if (mesh.vertex_alive(v)) points.push_back({now[v], state.velocity(v), mass_kg[v]});
  }
  const MassProperties rest = mass_properties(mesh.rest_body_m(), mesh.triangles(), settings.density_kg_per_m3);
  MassProperties shape = mass_properties(now, mesh.triangles(), 1);
  if (is_crushed(shape.volume_m3, rest.volume_m3)) {
    take_rest_shape(mesh, frame_world, now);
    shape = mass_properties(now, mesh.triangles(), 1);
  }
  const double mass = rest.mass_kg;
  if (!(mass > 0) || !(shape.mass_kg > 0) || !(shape.inertia_kg_m2.determinant() > 0)) return nullptr;

  auto motion = std::make_unique<RigidMotion>();
  motion->settings_ = settings;
  motion->mass_kg_.assign(mass_kg.begin(), mass_kg.end());
  motion->frame_at_release_ = frame_world;
  motion->body = RigidBody(mass, mass / shape.mass_kg * shape.inertia_kg_m2, shape.centre_m);
  motion->centre_at_release_world_m_ = shape.centre_m;
  const RigidVelocity velocity = rigid_velocity(points);
  motion->body.set_velocity(velocity.at(shape.centre_m), velocity.angular_velocity_rad_per_s);
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    motion->arm_m_.push_back(now[v] - shape.centre_m);
    if (mesh.vertex_alive(v)) motion->radius_m_ = std::max(motion->radius_m_, motion->arm_m_[v].norm());
  }
  motion->place(part.particles);
  return motion;
}

void RigidMotion::step(const SharedBody& self, std::span<const PointConstraint> constraints, std::span<Reaction>) {
  constraints_.assign(constraints.begin(), constraints.end());
  reactions_.assign(constraints.size(), {});
  contacts_.clear();
  for (const PointConstraint& c : constraints) {
    contacts_.push_back(contact_of(c, self.particles.view(), settings_.step_s, settings_.friction));
    if (!c.unilateral || contacts_.back().depth_m > 0) body.wake();
  }
}

void RigidMotion::append_contacts(std::uint32_t number, std::vector<BodyContact>& contacts) const {
  for (BodyContact contact : contacts_) {
    contact.one.body = number;
    contacts.push_back(contact);
  }
}

void RigidMotion::react(std::size_t constraint, const Vec3& impulse_on_tool_n_s) {
  if (!impulse_on_tool_n_s.allFinite()) return;  // the body is mended at the end of the step
  reactions_[constraint].force_on_tool_n = impulse_on_tool_n_s / settings_.step_s;
  reactions_[constraint].active = !impulse_on_tool_n_s.isZero(0);
}

void RigidMotion::move(const SharedBody& self, bool supported) {
  body.move(settings_.step_s);
  body.rest(supported, radius_m_, settings_.step_s);
  if (is_finite()) place(self.particles);
}

void RigidMotion::restore(const SharedBody& self, const DeformationState* state) {
  if (state && !state->frames_world.empty())
    body.rest_at(state->frames_world[0]);
  else
    body.rest_at(is_finite() ? body.pose_world() : pose_at_release());
  place(self.particles);
}

bool RigidMotion::is_finite() const {
  return sectio::is_finite(body.pose_world()) && body.momentum_kg_m_per_s().allFinite() &&
         body.angular_momentum_kg_m2_per_s().allFinite();
}

void RigidMotion::place(ParticleState& particles) const {
  const Vec3 velocity = body.velocity_m_per_s(), spin = body.angular_velocity_rad_per_s();
  const Mat3 turn = body.pose_world().orientation.toRotationMatrix();
  for (std::size_t v = 0; v < arm_m_.size(); ++v) {
    const Vec3 arm = turn * arm_m_[v];
    particles.place(v, body.pose_world().position_m + arm, velocity + spin.cross(arm));
  }
}

Pose RigidMotion::rest_frame_world(VertexId) const {
  const Pose& now = body.pose_world();
  return {now.to_world(frame_at_release_.position_m - centre_at_release_world_m_),
          now.orientation * frame_at_release_.orientation};
}

double RigidMotion::energy_j(const SharedBody&) const {
  return body.kinetic_energy_j() - body.mass_kg() * settings_.gravity_m_per_s2.dot(body.pose_world().position_m);
}

}  // namespace sectio
