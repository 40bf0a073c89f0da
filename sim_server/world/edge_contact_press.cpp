// An edge that presses, or holds the end of its cut: contact by temporary elements, gaps, and what is pushed through.
#include <algorithm>

#include "sim_server/surface/indentation/contact_places.h"
#include "sim_server/world/edge_contact.h"
#include "sim_server/world/indentation.h"

namespace sectio {
namespace {

constexpr double kIn_m = 3e-4;     // this far beneath the lid of a groove a blade is in it
constexpr double kAside_m = 5e-4;  // between looks for a lid beside a wall
constexpr int kMostAside = 6;      // looks

}  // namespace

// Collects the contacts of paper A, 2.2: the point that presses, and along the instrument from there all places that
// are beneath the surface.
void EdgeContact::press_with_templates(const Vec3& contact_world_m) {
  const MeshDraft surface = original_surface(body_);
  if (!surface.triangle(triangle_).alive()) {
    ++searches_;
    const auto closest = body_.tree().closest(body_.view(), contact_world_m, kNear_m);
    if (!closest) return;
    triangle_ = original_triangle(body_, closest->triangle);
    bary_.setConstant(1.0 / 3);
  }
  const Pose frame = body_.frame_world(surface.triangle(triangle_).v[0]);
  normal_ = body_.home_normal_world(surface, surface.triangle(triangle_).v, bary_);
  const auto to_body = [&](const Vec3& x_world_m) -> Vec3 {
    return frame.orientation.conjugate() * (x_world_m - frame.position_m);
  };
  const SurfacePoint at =
      seen_along(surface, triangle_, to_body(contact_world_m), frame.orientation.conjugate() * normal_);
  triangle_ = at.triangle;
  bary_ = at.bary;
  normal_ = body_.home_normal_world(surface, surface.triangle(triangle_).v, bary_);
  const std::span<const ContactPoint> before = body_.contact.points;
  contact_points_.push_back({contact_place(surface, at, before), contact_world_m, normal_, edge_id_});
  ContactLine line{at.triangle, to_body(contact_world_m), {}, frame.orientation.conjugate() * normal_};
  for (const std::size_t corner : corners_beside_contact()) {
    line.corner_body_m = to_body(corners_at(pose_).at_world_m[corner]);
    for (const PlaceOnLine& p : contact_places_along(surface, line, before))
      contact_points_.push_back({p.place, frame.to_world(p.target_body_m), normal_, edge_id_});
  }
}

// The ends of the lines from the point that presses: the neighbours of a corner, or both ends of a side.
std::vector<std::size_t> EdgeContact::corners_beside_contact() const {
  if (contact_corners_[0] != contact_corners_[1]) return {contact_corners_[0], contact_corners_[1]};
  std::vector<std::size_t> beside;
  for (const auto& [p, q] : kSegmentCorners) {
    if (instrument_.front_is_virtual && p == 2 && q == 3) continue;
    if (p == contact_corners_[0]) beside.push_back(q);
    if (q == contact_corners_[0]) beside.push_back(p);
  }
  return beside;
}

void EdgeContact::hold_particles(std::span<const HeldParticle> held) {
  for (const HeldParticle& h : held) {
    if (h.owner != edge_id_) continue;
    PointConstraint c = hold(h.vertex, h.target_world_m);
    c.unilateral = c.sticks = true;
    c.normal = normal_;
    constraints_.push_back(c);
  }
}

double EdgeContact::beneath_temporary_m(const Vec3& contact_world_m) const {
  if (constraints_.empty()) return 0;
  const MeshDraft surface(body_.mesh, body_.particle_view());
  const SurfacePoint at = nearest_from(surface, surface.incident(constraints_.front().v[0]), contact_world_m);
  const Corners c = body_.view().corners(at.triangle);
  const Vec3 nearest = at.bary[0] * c[0] + at.bary[1] * c[1] + at.bary[2] * c[2];
  return std::max(0.0, (nearest - contact_world_m).dot((c[1] - c[0]).cross(c[2] - c[0]).stableNormalized()));
}

// The normal for a line along the surface; a line that leads into the surface has the surface beside it.
ContactGap EdgeContact::gap() {
  if (phase_ != Phase::pressing) return {};
  constexpr int kSamples = 100;
  constexpr double kAlong = 0.5;    // cosine of a line's angle to the surface
  constexpr double kLook_m = 0.03;  // for the surface, up and down from the line
  const MeshDraft original = original_surface(body_);
  const Pose frame = body_.frame_world(original.triangle(triangle_).v[0]);
  const Eigen::Quaterniond to_body = frame.orientation.conjugate();
  const auto depth_m = [&](const Vec3& q) {
    const SurfacePoint home = seen_along(original, triangle_, to_body * (q - frame.position_m), to_body * normal_);
    return (body_.home_world_m(original.triangle(home.triangle).v, home.bary) - q).dot(normal_);
  };
  const Vec3 from = contact_world_m();
  ContactGap most{depth_m(from), 0};
  for (const std::size_t corner : corners_beside_contact()) {
    const Vec3 line = corners_at(pose_).at_world_m[corner] - from;
    if ((line - line.dot(normal_) * normal_).norm() < kAlong * line.norm()) continue;
    for (int i = 0; i <= kSamples; ++i) {
      const Vec3 q = from + i / double{kSamples} * line;
      if (depth_m(q) < 0.5 * most.depth_m) break;
      double nearest_m = kLook_m;
      for (const SurfaceHit& hit : body_.tree().hits(body_.view(), q + kLook_m * normal_, q - kLook_m * normal_))
        nearest_m = std::min(nearest_m, (hit.point_world_m - q).norm());
      most.gap_m = std::max(most.gap_m, nearest_m);
    }
  }
  return most;
}

bool EdgeContact::is_blunt() const {
  const InstrumentShape shape = shape_at(pose_.opening_rad);
  return (shape.edge_tip_tool_m - shape.edge_heel_tool_m).isZero();
}

bool EdgeContact::is_pushed_through(const Vec3& tip_world_m) const {
  return !body_.tree().inside(body_.view(), tip_world_m - kBeneath_m * normal_);
}

bool EdgeContact::is_clear_of_body() const {
  const ToolCorners corners = corners_at(pose_);
  const CollisionEngine& tree = body_.tree();
  if (tree.inside(body_.view(), corners.at_world_m[0])) return false;
  return std::ranges::all_of(kSegmentCorners, [&](const auto& ends) {
    return tree.hits(body_.view(), corners.at_world_m[ends[0]], corners.at_world_m[ends[1]]).empty();
  });
}

void EdgeContact::slip_off() {
  events_.push_back({EventKind::contact_ended, "it was pushed through, and the skin slipped off"});
  phase_ = Phase::through;
  force_n_.setZero();
  smooth_force_n_ = 0;
}

// A blade that doesn't cut takes the end of its cut along.
void EdgeContact::take_along(VertexId end, const Vec3& to_world_m) {
  const Vec3 at = body_.particle_view().position(end);
  PointConstraint c = drag(end, at, to_world_m, step_s_);
  c.largest_force_n = largest_force_n_;
  constraints_.assign(1, c);
}

// A cut of another instrument may have made the end of this one anew.
void EdgeContact::hold_end_again() {
  if (phase_ != Phase::cutting || constraints_.empty()) return;
  const auto cut = body_.engines.cutting->cut_point(body_.shared(), edge_id_);
  if (cut && cut->follows != kNone)
    constraints_.front().v[0] = cut->follows;
  else
    constraints_.clear();
}

// A blade that comes between the lips of a cut is in the tissue, without a force. So is one that presses a wall, where
// it came in between the lips, and whose edge reaches up through the skin beyond the end of the cut.
bool EdgeContact::enter_open_cut() {
  const bool may_cut = cuts_ && (instrument_.tip_pierces || may_enter());
  if (!may_cut || body_.rigid() || body_.cut_traits.edge_cuts_anywhere) return false;
  const bool on_wall = phase_ == Phase::pressing && body_.mesh.triangle(triangle_).surface == Surface::wall;
  Blade blade = blade_at(pose_);
  const auto is_in = [&](const Vec3& above_world_m) {
    return (above_world_m - blade.tip_world_m).dot(blade.up_world) >= kIn_m;
  };
  const BladeLine line = line_of(blade);
  if (on_wall)
    if (const auto skin = skin_entered(line, line.tip_world_m); skin && is_in(skin->point_world_m))
      return enter_from_above({edge_id_, skin->triangle, skin->bary});
  auto cut = body_.engines.cutting->in_open_cut(body_.shared(), blade);
  // A tip that has slid from the skin over the end of a groove presses the wall: the lid is a little aside.
  for (int look = 0; on_wall && !cut && look < kMostAside; ++look) {
    blade.tip_world_m += kAside_m * body_.view().normal(triangle_);
    cut = body_.engines.cutting->in_open_cut(body_.shared(), blade);
  }
  if (!cut || !is_in(cut->point_world_m) || skin_entered(line, cut->point_world_m)) return false;
  return enter_from_above({edge_id_, cut->beside, Vec3::Constant(1.0 / 3)});
}

bool EdgeContact::enter_from_above(const Entry& at) {
  if (phase_ == Phase::pressing) events_.push_back({EventKind::contact_ended});
  constraints_.clear();
  break_in(at);
  return true;
}

}  // namespace sectio
