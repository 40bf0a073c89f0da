#include "sim_server/world/grasp.h"

#include <algorithm>
#include <map>
#include <utility>

#include "common/core/sort_unique.h"

namespace sectio {
namespace {

constexpr double kBetweenJaws_m = 0.0015;  // a piece whose surface is this close to the tips is between them
constexpr double kJaw_m = 0.015;           // so far about the tips are the springs that keep a piece from turning
constexpr double kSlipsAt = 1.5;           // lag over the way that springs give: the inertia of a piece is borne
constexpr double kStirred_m = 0.02;        // a box may have moved by this since it was made

Vec3 position_of(const Body& body, VertexId v) {
  return body.particle_view().position(v);
}

// The vertices of the triangles near a point, ascending.
std::vector<VertexId> vertices_near(Body& body, const Vec3& at_world_m, double within_m) {
  std::vector<VertexId> near;
  Box3 box = body.bounds_world_m();
  if (box.isEmpty() || box.exteriorDistance(at_world_m) > within_m + kStirred_m) return near;
  constexpr std::array<std::array<std::size_t, 2>, 1> kPoint{{{0, 0}}};
  std::vector<TriangleId> triangles;
  body.tree().near_segments(body.view(), std::array{at_world_m}, kPoint, within_m, triangles);
  for (const TriangleId t : triangles)
    for (const VertexId v : body.mesh.triangle(t).v)
      if ((position_of(body, v) - at_world_m).norm() <= within_m) near.push_back(v);
  sort_unique(near);
  return near;
}

}  // namespace

Grasp::Grasp(const ToolSpec& tool)
    : instrument_(instrument_of(tool.kind)),
      geometry_(tool.geometry),
      largest_force_n_(tool.grip_force_n.value_or(instrument_.grip_force_n)),
      radius_m_(tool.grip_radius_m.value_or(instrument_.grip_radius_m)) {}

bool Grasp::holds(std::uint32_t body_id) const {
  return std::ranges::find(held_, body_id, &Held::body_id) != held_.end();
}

std::optional<std::uint32_t> Grasp::held_body() const {
  return held_.empty() ? std::nullopt : std::optional(held_.front().body_id);
}

std::vector<GraspEvent> Grasp::take_events() {
  return std::exchange(events_, {});
}

void Grasp::let_go(std::string_view why) {
  for (const Held& held : held_) events_.push_back({EventKind::released, held.body_id, why});
  held_.clear();
}

Vec3 Grasp::place_of(const Point& p, const Body& body) {
  return p.vertex == kNone ? body.frame_world(0).to_world(p.at_piece_m) : position_of(body, p.vertex);
}

// Three points about the tips, in the frame of the tool, and their present places in the frame of the piece.
std::vector<Grasp::Point> Grasp::points_of_jaws(const Body& piece, double share) const {
  const ToolGeometry& g = geometry_;
  const Vec3 up = (g.c_tool_m - g.a_tool_m).stableNormalized(), aside = up.unitOrthogonal();
  std::vector<Point> points;
  for (const Vec3& jaw : {up, aside, Vec3(up.cross(aside))}) {
    Point p;
    p.at_tool_m = g.a_tool_m + kJaw_m * jaw;
    p.at_piece_m = piece.frame_world(0).to_local(pose_.to_world(p.at_tool_m));
    p.share = share / 3;
    points.push_back(p);
  }
  return points;
}

// A loose piece is taken before the tissue that it lies in.
bool Grasp::hold_piece(std::span<const std::unique_ptr<Body>> bodies) {
  const Vec3 tips = pose_.to_world(geometry_.a_tool_m);
  double nearest_m = kBetweenJaws_m;
  for (const auto& body : bodies) {
    if (body->deforms() || body->frozen) continue;
    const auto closest = body->tree().closest(body->view(), tips, kBetweenJaws_m);
    const double distance_m = body->tree().inside(body->view(), tips) ? 0
                              : closest                               ? closest->distance_m
                                                                      : kBetweenJaws_m;
    if (distance_m >= nearest_m) continue;
    nearest_m = distance_m;
    held_.assign(1, {body->id, points_of_jaws(*body, 1)});
  }
  return !held_.empty();
}

// The vertices of the nearest body in the sphere, or the corners of a triangle if the mesh is wider than the sphere.
void Grasp::hold_tissue(std::span<const std::unique_ptr<Body>> bodies) {
  const Vec3 tips = pose_.to_world(geometry_.a_tool_m);
  Body* body = nullptr;
  std::optional<ClosestSurfacePoint> nearest;
  for (const auto& b : bodies) {
    if (!b->deforms() || b->frozen) continue;
    const auto closest = b->tree().closest(b->view(), tips, radius_m_);
    if (!closest || (nearest && nearest->distance_m <= closest->distance_m)) continue;
    nearest = closest;
    body = b.get();
  }
  if (!body) return;
  std::vector<VertexId> vertices = vertices_near(*body, tips, radius_m_);
  if (vertices.empty()) {
    const auto& corners = body->mesh.triangle(nearest->triangle).v;
    vertices.assign(corners.begin(), corners.end());
  }
  Held held{body->id, {}};
  for (const VertexId v : vertices)
    if (!body->engines.deformation->fixed(v))
      held.points.push_back(
          {v, Vec3::Zero(), pose_.to_local(position_of(*body, v)), body->engines.deformation->mass_kg(v)});
  if (held.points.empty()) return;
  held_.clear();
  held_.push_back(std::move(held));
  share_out();
}

void Grasp::share_out() {
  held_at_m_.reset();
  double sum = 0;
  for (const Held& held : held_)
    for (const Point& p : held.points) sum += p.share;
  for (Held& held : held_)
    for (Point& p : held.points) p.share /= sum;
}

void Grasp::withdraw() {
  let_go("withdrawn");
  open_ = false;
}

// Follows the mean of the held points. They slip when their mean distance from their targets is too large.
void Grasp::track(std::span<const std::unique_ptr<Body>> bodies, double step_s) {
  Vec3 place_m = Vec3::Zero(), lag_m = Vec3::Zero();
  for (const Held& held : held_)
    for (const Point& p : held.points) {
      const Vec3 at_m = place_of(p, *bodies[held.body_id]);
      place_m += p.share * at_m;
      lag_m += p.share * (target_of(p) - at_m);
    }
  if (lag_m.norm() > (holds_tissue() ? 1 : kSlipsAt) * radius_m_) let_go("slipped");
  velocity_m_per_s_ = held_at_m_ && !held_.empty() ? Vec3((place_m - *held_at_m_) / step_s) : Vec3::Zero();
  held_at_m_ = held_.empty() ? std::nullopt : std::optional(place_m);
}

void Grasp::follow(const JointPose& pose, std::span<const std::unique_ptr<Body>> bodies, double step_s) {
  pose_ = pose;
  const Vec3 ahead_m = pose.position_m - springs_at_m_;
  const double furthest_m = held_.empty() ? ahead_m.norm() : kFastestHand_m_per_s * step_s;
  springs_at_m_ += std::min(1.0, furthest_m / std::max(ahead_m.norm(), furthest_m)) * ahead_m;
  known_force_n_ = std::exchange(force_on_tool_n_, Vec3::Zero());
  if (!(instrument_.grip_below_rad > 0)) return;
  const bool was_open = std::exchange(open_, pose.opening_rad >= instrument_.grip_below_rad);
  if (open_) let_go("opened");
  std::erase_if(held_, [&](const Held& held) {
    const bool gone = held.points.empty(), frozen = bodies[held.body_id]->frozen;
    if (gone || frozen) events_.push_back({EventKind::released, held.body_id, gone ? "cut away" : "frozen"});
    return gone || frozen;
  });
  if (was_open && !open_) {
    if (!hold_piece(bodies)) hold_tissue(bodies);
    for (const Held& held : held_) events_.push_back({EventKind::grasped, held.body_id});
  }
  track(bodies, step_s);
}

void Grasp::append(const Body& body, double step_s, std::vector<PointConstraint>& constraints) const {
  const auto held = std::ranges::find(held_, body.id, &Held::body_id);
  if (held == held_.end()) return;
  for (const Point& p : held->points) constraints.push_back(constraint_of(p, body, step_s));
}

Vec3 Grasp::target_of(const Point& p) const {
  return p.vertex == kNone ? Vec3(springs_at_m_ + pose_.orientation * p.at_tool_m) : pose_.to_world(p.at_tool_m);
}

// A rigid piece is held at points of its own, tissue by its vertices.
PointConstraint Grasp::constraint_of(const Point& p, const Body& body, double step_s) const {
  const Vec3 at = place_of(p, body);
  PointConstraint c = p.vertex == kNone ? hold(p.vertex, target_of(p)) : drag(p.vertex, at, target_of(p), step_s);
  c.point_world_m = at;
  if (p.vertex == kNone) c.compliance_m_per_n = 1 / (p.share * stiffness_n_per_m());
  c.largest_force_n = p.share * largest_force_n_;
  return c;
}

void Grasp::felt(const Reaction& reaction) {
  if (reaction.is_known)
    force_on_tool_n_ += reaction.force_on_tool_n;
  else
    force_on_tool_n_ = known_force_n_;
}

void Grasp::follow(std::uint32_t body_id, const TopologyDelta& delta) {
  const auto held = std::ranges::find(held_, body_id, &Held::body_id);
  if (held == held_.end()) return;
  const auto changed = [&](const Point& p) {
    return p.vertex != kNone && (p.vertex >= delta.vertex_slots_after ||
                                 std::ranges::binary_search(delta.vertices, p.vertex, {}, &VertexEdit::id));
  };
  if (std::erase_if(held->points, changed) > 0) share_out();
}

void Grasp::part_left(std::uint32_t parent_id, const Body& part, std::span<const VertexId> vertex_from) {
  const auto held = std::ranges::find(held_, parent_id, &Held::body_id);
  if (held == held_.end()) return;
  std::map<VertexId, VertexId> slot_in_part;
  for (VertexId v = 0; v < vertex_from.size(); ++v) slot_in_part[vertex_from[v]] = v;
  Held taken{part.id, {}};
  double share = 0;
  std::erase_if(held->points, [&](Point p) {
    const auto in_part = slot_in_part.find(p.vertex);
    if (in_part == slot_in_part.end()) return false;
    p.vertex = in_part->second;
    share += p.share;
    taken.points.push_back(p);
    return true;
  });
  if (taken.points.empty()) return;
  if (!part.deforms()) taken.points = points_of_jaws(part, share);
  if (held->points.empty()) {
    events_.push_back({EventKind::released, parent_id, "what it holds came off"});
    held_.erase(held);
  }
  held_at_m_.reset();
  events_.push_back({EventKind::grasped, part.id, "came off"});
  held_.push_back(std::move(taken));
}

}  // namespace sectio
