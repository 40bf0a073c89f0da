// Bodies that deform press against each other as instruments press them: within their steps, not after them. Between
// the surfaces, in the middle of their overlap, is a wall that goes on as they do, and a thin layer on each side of it
// gives way. Each body meets its own side in its own step:
//
//   F = k (1 + d / d0) d,   k = A sqrt(E rho) / h,   d: how far its point gets beyond the wall
//
// A is the area that a vertex stands for, h the step. So a light touch is answered as the tissue behind it does within
// a step, through which sound goes c h deep: k = E A / (c h), that of the softer. A wave that arrives at the wall then
// goes through instead of being thrown back (a matched impedance), so that both sides agree after a few steps, whatever
// their meshes, and at rest each bears the same. That much alone bears little: a ball that touches with a square
// centimetre would sink in by millimetres. So the layer hardens, over d0, as it is pressed together.
//
// A point that nothing can move, of a body that is held or sleeps, is the wall itself, and the other one's impedance
// counts.
//
// Friction is a spring along the wall, of the same stiffness, from where the two points stuck to each other, until it
// would pull harder than mu F (world/stuck_points.h).
//
// An impulse after the step, as collide() gives one to a body that moves as a whole, finds a vertex as light as it is:
// the tissue behind throws it back within the next step, and no piece comes to rest.
#include <algorithm>
#include <cmath>
#include <optional>

#include "sim_server/body_contact/find_bodies.h"
#include "sim_server/step/step.h"

namespace sectio {
namespace {

constexpr double kMostReach_m = 5e-3;  // however fast the bodies are
constexpr double kHardens_m = 2e-5;    // d0
// Depth is undone no faster: bodies that begin in each other aren't thrown.
constexpr double kParting_m_per_s = 0.1;
constexpr double kHeld = 1e-6;  // a held point moves by less than this share of the other point, under the same push

bool moves(const Body& body) {
  return body.deforms() && !body.stands_still();
}
// A body that stands still is a wall for those that move. Organs that the scene places within each other are as good as
// one.
bool may_meet(const SimulatedWorld& world, const Body& one, const Body& other) {
  return one.deforms() && other.deforms() && (moves(one) || moves(other)) && !world.are_nested(one, other);
}

double fastest_m_per_s(const Body& body) {
  float most = 0;
  if (moves(body))
    for (const Vec4f& v : body.particles.velocity_world_m_per_s) most = std::max(most, v.head<3>().squaredNorm());
  return std::sqrt(double{most});
}

double impedance_pa_s_per_m(const Body& body) {
  return std::sqrt(body.spec.material.young_pa * body.spec.material.density_kg_per_m3);
}

// A point of a body's surface.
struct Place {
  ContactSide side;
  Vec3 at_world_m = Vec3::Zero(), velocity_m_per_s = Vec3::Zero();
  double inverse_mass_per_kg = 0;

  Place(Body& body, const ContactSide& s) : side(s), at_world_m(body.position_at(s.v, s.weights)) {
    if (!moves(body)) return;
    velocity_m_per_s = body.velocity_at(s.v, s.weights, at_world_m);
    const ContactBody nodes = body.contact_body();
    std::vector<NodeShare> carriers;
    for (std::size_t i = 0; i < s.v.size(); ++i) {
      const double weight = s.weights[static_cast<int>(i)];
      if (s.v[i] == kNone || weight == 0) continue;
      nodes.deformation->nodes_of(s.v[i], carriers);
      for (const NodeShare& c : carriers) {
        const double share = weight * c.weight;
        inverse_mass_per_kg += share * share * nodes.deformation->node(nodes.particles, c.node).inverse_mass_per_kg;
      }
    }
  }
};

// A wall between two points.
struct Wall {
  Vec3 velocity_m_per_s;
  double one_gives = 0.5;  // the share of their overlap by which the first one is beyond the wall
  bool held = false;       // one of the points is the wall: what holds it takes what the other gives
};
Wall wall_between(const Place& one, const Place& other) {
  const bool one_held = one.inverse_mass_per_kg <= kHeld * other.inverse_mass_per_kg;
  const bool other_held = other.inverse_mass_per_kg <= kHeld * one.inverse_mass_per_kg;
  const double one_gives = one_held ? 0 : other_held ? 1 : 0.5;
  return {(1 - one_gives) * one.velocity_m_per_s + one_gives * other.velocity_m_per_s, one_gives,
          one_held || other_held};
}

// The wall for one side, which is beyond it by `overlap_m`; `out`: out of its tissue.
PointConstraint wall_for(const Place& own, double overlap_m, const Vec3& way_m, const Vec3& out, double step_s) {
  PointConstraint c;
  c.v = own.side.v;
  c.w = {own.side.weights.x(), own.side.weights.y(), own.side.weights.z()};
  c.unilateral = true;
  c.normal = out;
  c.target_world_m = own.at_world_m + way_m - std::min(overlap_m, kParting_m_per_s * step_s) * out;
  c.compliance_m_per_n = 1 / (1 + std::max(0.0, overlap_m) / kHardens_m);
  return c;
}

class Touch {
 public:
  Touch(Body& one, Body& other, double step_s) : one_(one), other_(other), step_s_(step_s) {}

  void find(double reach_m) {
    std::vector<BodyContact> contacts;
    find_body_contacts({one_.view(), one_.tree()}, {other_.view(), other_.tree()}, reach_m, contacts, kMaxProbedSoft);
    for (const BodyContact& c : contacts)
      if (c.area_m2 > 0) pairs_.push_back({c, Place(one_, c.one), Place(other_, c.other)});
    wake();
  }
  void append_walls(StepContext& context, StuckPoints& stuck) const {
    if (pairs_.empty()) return;
    const std::size_t meeting = context.meetings.size();
    context.meetings.push_back({{one_.id, other_.id}});
    std::vector<Wall> walls;
    Vec3 way_m = Vec3::Zero();
    double moving = 0;
    for (const Pair& p : pairs_) {
      walls.push_back(wall_between(p.one, p.other));
      if (walls.back().held) continue;
      way_m += step_s_ * walls.back().velocity_m_per_s;
      ++moving;
    }
    way_m /= std::max(1.0, moving);
    const double of_one = impedance_pa_s_per_m(one_), of_other = impedance_pa_s_per_m(other_);
    const double friction = std::max(one_.spec.splitting.friction, other_.spec.splitting.friction);
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const Pair& p = pairs_[i];
      const Wall& wall = walls[i];
      const Vec3 own_way_m = wall.held ? Vec3(step_s_ * wall.velocity_m_per_s) : way_m;
      const Vec3 stuck_m = friction > 0 ? apart_from_where_they_stuck_m(p, friction, stuck) : Vec3::Zero();
      const auto append = [&](const Place& own, const Body& body, double gives, const Vec3& out, const Vec3& back_m) {
        if (!moves(body)) return;
        PointConstraint c = wall_for(own, gives * p.contact.depth_m, own_way_m + gives * back_m, out, step_s_);
        const double impedance = !wall.held ? std::min(of_one, of_other) : &body == &one_ ? of_one : of_other;
        c.compliance_m_per_n *= step_s_ / (impedance * p.contact.area_m2);
        c.friction = friction;
        c.springs_along = true;
        context.bodies[body.id].walls.push_back({c, wall.held ? std::nullopt : std::optional(meeting)});
      };
      append(p.one, one_, wall.one_gives, -p.contact.normal_world, -stuck_m);
      append(p.other, other_, 1 - wall.one_gives, p.contact.normal_world, stuck_m);
    }
  }

 private:
  struct Pair {
    BodyContact contact;
    Place one, other;
  };

  // Points slip where the springs along the surface would pull harder than friction does: at a push of k d and a pull
  // of k u, with the same k, further than u = mu d.
  Vec3 apart_from_where_they_stuck_m(const Pair& p, double friction, StuckPoints& stuck) const {
    const bool is_vertex_of_one = p.contact.one.v[1] == kNone;
    const ContactSide& own = is_vertex_of_one ? p.contact.one : p.contact.other;
    const ContactSide& other = is_vertex_of_one ? p.contact.other : p.contact.one;
    const Body &body = is_vertex_of_one ? one_ : other_, &body_of_other = is_vertex_of_one ? other_ : one_;
    const Vec3 vertex_m = body.position_at(own.v, own.weights);
    const auto way_from = [&](const StuckPoints::OnTriangle& on) -> Vec3 {
      return vertex_m - body_of_other.position_at(on.v, on.weights);
    };
    const double most_m = friction * p.contact.depth_m;
    const Vec3 apart_m = stuck.slide({one_.id, other_.id, is_vertex_of_one ? 0u : 1u, own.v[0]},
                                     {other.v, other.weights}, way_from, p.contact.normal_world, most_m);
    return is_vertex_of_one ? apart_m : Vec3(-apart_m);
  }

  // A body that sleeps is woken by one that bumps into it, unless only a light vertex trembles; an organ also by one
  // that presses slowly.
  void wake() {
    const auto is_lively = [](const Body& body) { return !body.asleep() && !body.is_calm(); };
    const bool may_bump = is_lively(one_) || is_lively(other_);
    const bool both_held = one_.spec.fixed && other_.spec.fixed;
    for (const Pair& p : pairs_) {
      const Vec3 nearing_m_per_s = p.other.velocity_m_per_s - p.one.velocity_m_per_s;
      const bool bumps = may_bump && nearing_m_per_s.dot(p.contact.normal_world) > kWaking_m_per_s;
      if (!bumps && !(both_held && p.contact.depth_m > kTouchReach_m)) continue;
      for (Body* body : {&one_, &other_})
        if (body->asleep()) body->wake();
    }
  }

  Body &one_, &other_;
  double step_s_;
  std::vector<Pair> pairs_;
};

}  // namespace

void meet(SimulatedWorld& world, StepContext& context) {
  const auto& bodies = world.bodies;
  const double step_s = world.scene.step_s;
  for (std::uint32_t a = 0; a < bodies.size(); ++a)
    for (std::uint32_t b = a + 1; b < bodies.size(); ++b) {
      Body &one = *bodies[a], &other = *bodies[b];
      if (!may_meet(world, one, other)) continue;
      const auto are_near = [&](double reach_m) {
        const Box3 box = one.bounds_world_m();
        return !box.isEmpty() && grown(box, reach_m).intersects(other.bounds_world_m());
      };
      if (!are_near(kMostReach_m)) continue;
      const double way_m = step_s * (fastest_m_per_s(one) + fastest_m_per_s(other));
      const double reach_m = std::min(kMostReach_m, kTouchReach_m + way_m);
      if (!are_near(reach_m)) continue;
      Touch touch(one, other, step_s);
      touch.find(reach_m);
      touch.append_walls(context, world.stuck);
    }
  world.stuck.end_step();
}

}  // namespace sectio
