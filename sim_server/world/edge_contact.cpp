#include "sim_server/world/edge_contact.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/math/intersect.h"
#include "sim_server/surface/indentation/contact_places.h"
#include "sim_server/world/indentation.h"

namespace sectio {
namespace {

constexpr double kForceFilter_s = 0.005;  // low-pass of pushing and cutting forces, as long as a device's own
constexpr double kSteep = 0.5;            // cosine to the normal from which on a blade passes through a surface

RuptureThreshold threshold_of(const CuttingSpec& cutting) {
  return {cutting.threshold_force_n, cutting.threshold_displacement_m, cutting.hysteresis};
}

// The length of a blade's edge beneath the surface at a point; for a blade that lies along the surface, up to the
// nearest point.
double height_m_at(const Vec3& point_world_m, const Vec3& normal, const Blade& blade) {
  const Vec3 from_tip = point_world_m - blade.tip_world_m;
  const double steepness = blade.up_world.dot(normal);
  return steepness > kSteep ? from_tip.dot(normal) / steepness : from_tip.dot(blade.up_world);
}

const SurfaceHit* first_entering(const std::vector<SurfaceHit>& hits) {
  const auto it = std::find_if(hits.begin(), hits.end(), [](const SurfaceHit& h) { return h.entering; });
  return it != hits.end() ? &*it : nullptr;
}

}  // namespace

EdgeContact::EdgeContact(std::uint32_t edge_id, const ToolSpec& tool, std::size_t edge, Body& body, bool cuts,
                         double step_s)
    : edge_id_(edge_id),
      instrument_(instrument_of(tool.kind)),
      geometry_(tool.geometry),
      instrument_state_{tool.intensity, 0, edge},
      largest_force_n_(tool.largest_force_n),
      step_s_(step_s),
      cuts_(cuts),
      body_(body),
      threshold_(threshold_of(body.spec.cutting)) {}

ContactState EdgeContact::state() const {
  switch (phase_) {
    case Phase::free:
    case Phase::through:
      return ContactState::free;
    case Phase::pressing:
      return ContactState::contact;
    default:
      return ContactState::penetration;
  }
}

std::vector<ContactEvent> EdgeContact::take_events() {
  return std::exchange(events_, {});
}

InstrumentShape EdgeContact::shape_at(double opening_rad) const {
  InstrumentState state = instrument_state_;
  state.opening_rad = opening_rad;
  return instrument_.shape(geometry_, state);
}

ToolCorners EdgeContact::corners_at(const JointPose& pose) const {
  const InstrumentShape shape = shape_at(pose.opening_rad);
  return {{pose.to_world(shape.a_tool_m), pose.to_world(shape.b_tool_m), pose.to_world(shape.c_tool_m),
           pose.to_world(shape.d_tool_m)}};
}

bool EdgeContact::may_enter() const {
  return cuts_ && instrument_.may_enter(jaws_between(opening_before_rad_, pose_.opening_rad));
}

bool EdgeContact::near_body(const std::optional<JointPose>& before, std::span<const JointPose> poses) const {
  Box3 box = body_.bounds_world_m();
  box.min() -= Vec3::Constant(kNear_m);
  box.max() += Vec3::Constant(kNear_m);
  Box3 tool;
  const auto extend = [&](const JointPose& pose) {
    for (const Vec3& corner : corners_at(pose).at_world_m) tool.extend(corner);
  };
  if (before) extend(*before);
  for (const JointPose& pose : poses) extend(pose);
  return !tool.isEmpty() && box.intersects(tool);
}

void EdgeContact::set_free() {
  if (phase_ == Phase::pressing) events_.push_back({EventKind::contact_ended});
  if (phase_ == Phase::cutting) events_.push_back({EventKind::cut_ended});
  phase_ = Phase::free;
  said_tip_is_outside_ = false;
  front_.release();
  force_n_.setZero();
  smooth_force_n_ = 0;
}

void EdgeContact::approach(const std::optional<JointPose>& before, std::span<const JointPose> poses, bool continuous) {
  constraints_.clear();
  contact_points_.clear();
  if (before || !poses.empty()) pose_ = poses.empty() ? *before : poses.back();
  opening_before_rad_ = before ? before->opening_rad : pose_.opening_rad;
  if (phase_ == Phase::through && is_clear_of_body()) phase_ = Phase::free, tracker_.reset();
  if (is_round()) return approach_round(before && continuous ? *before : pose_);
  const bool looks = phase_ == Phase::free || (phase_ == Phase::pressing && !at_tip_);
  if (looks && !near_body(before, poses)) {
    tracker_.reset();
    has_just_cut_ = false;
    if (phase_ == Phase::pressing) set_free();
    return;
  }
  if (looks && before) {
    JointPose from = *before;
    const std::array resting{pose_};  // the surface may come to an instrument that rests
    for (const JointPose& to : poses.empty() ? std::span<const JointPose>(resting) : poses) {
      const CollisionEngine& tree = body_.tree();
      look_for_contact(tracker_.follow(body_.view(), tree, {corners_at(from), corners_at(to), continuous}));
      from = to;
      if (phase_ != Phase::free) break;
    }
  }
  if ((phase_ == Phase::free || phase_ == Phase::pressing) && enter_open_cut()) return;
  if (phase_ == Phase::pressing) press();
  if (before && looks) say_when_tip_is_outside(*before);
  if (phase_ != Phase::cutting && before && looks && body_.cut_traits.edge_cuts_anywhere)
    if (const auto hit = sharp_edge_deep_inside(*before)) break_in({edge_id_, hit->triangle, hit->bary});
}

void EdgeContact::break_in(const Entry& at) {
  entry_ = at;
  phase_ = Phase::cutting;
  front_.release();
  smooth_force_n_ = 0;
  constraints_.clear();
  events_.push_back({EventKind::penetrated});
}

// The point at which the edge of an instrument that need not press reaches into the tissue.
std::optional<SurfaceHit> EdgeContact::edge_reaching_in(const ToolContact& contact,
                                                        const InstrumentShape& shape) const {
  if (!may_enter() || shape.edge_tip_tool_m == shape.edge_heel_tool_m) return {};
  if (!instrument_.front_is_virtual) {
    const auto hits =
        body_.tree().hits(body_.view(), pose_.to_world(shape.edge_heel_tool_m), pose_.to_world(shape.edge_tip_tool_m));
    const SurfaceHit* hit = first_entering(hits);
    return hit ? std::optional(*hit) : std::nullopt;
  }
  const SurfaceHit* hit = first_entering(contact[ToolSegment::cd].after);
  if (!hit) hit = first_entering(contact.path(ToolCorner::d));
  return hit ? std::optional(*hit) : std::nullopt;
}

void EdgeContact::look_for_contact(const ToolContact& contact) {
  const InstrumentShape shape = shape_at(pose_.opening_rad);
  if (const auto hit = edge_reaching_in(contact, shape)) return enter_tissue(*hit);
  const std::size_t tip = instrument_.front_is_virtual ? 2 : 0;
  if (const SurfaceHit* hit = first_entering(contact.corner_paths[tip]))
    return press_at(*hit, {tip, tip}, 0, instrument_.presses_with_tip);
  // The surface may have risen over a tip that rests: then the blade leaves the tissue before it enters it.
  const std::vector<SurfaceHit>& shaft = contact[ToolSegment::ab].after;
  if (instrument_.presses_with_tip && !shaft.empty() && !shaft.front().entering)
    return press_at(shaft.front(), {tip, tip}, 0, true);
  if (phase_ == Phase::pressing) return;

  // At the side of the instrument, the middle of the part that is inside presses.
  for (const ToolSegment segment : {ToolSegment::ab, ToolSegment::ac, ToolSegment::cd}) {
    const std::vector<SurfaceHit>& hits = contact[segment].after;
    if (hits.empty() || (instrument_.front_is_virtual && segment == ToolSegment::cd)) continue;
    const double from = hits.front().entering ? hits.front().parameter : 0;
    const double to = !hits.front().entering ? hits.front().parameter : hits.size() > 1 ? hits[1].parameter : 1;
    return press_at(hits.front(), kSegmentCorners[static_cast<std::size_t>(segment)], 0.5 * (from + to), false);
  }
}

void EdgeContact::press_at(const SurfaceHit& hit, const std::array<std::size_t, 2>& corners, double along,
                           bool at_tip) {
  if (phase_ == Phase::free) events_.push_back({EventKind::contact_began});
  phase_ = Phase::pressing;
  contact_corners_ = corners;
  contact_along_ = along;
  at_tip_ = at_tip;
  triangle_ = original_triangle(body_, hit.triangle);
  bary_ = body_.contact.inverse ? Vec3(Vec3::Constant(1.0 / 3)) : hit.bary;
}

Vec3 EdgeContact::contact_world_m() const {
  const InstrumentShape shape = shape_at(pose_.opening_rad);
  const std::array corners{shape.a_tool_m, shape.b_tool_m, shape.c_tool_m, shape.d_tool_m};
  const Vec3 &p = corners[contact_corners_[0]], &q = corners[contact_corners_[1]];
  return pose_.to_world(contact_corners_[0] == contact_corners_[1] ? p : Vec3(p + contact_along_ * (q - p)));
}

void EdgeContact::press() {
  const Vec3 contact = contact_world_m();
  if (body_.contact_by_templates()) return press_with_templates(contact);
  slide_to(contact);
  const Corners corners = body_.view().corners(triangle_);
  const Vec3 at = bary_[0] * corners[0] + bary_[1] * corners[1] + bary_[2] * corners[2];
  if ((at - contact).norm() > kNear_m) return set_free();  // no hand presses so far in a step: it has jumped through
  const MeshDraft surface(body_.mesh, body_.particle_view());
  normal_ = body_.home_normal_world(surface, body_.mesh.triangle(triangle_).v, bary_);
  PointConstraint c;
  for (std::size_t i = 0; i < 3; ++i) {
    c.v[i] = body_.mesh.triangle(triangle_).v[i];
    c.w[i] = bary_[static_cast<int>(i)];
  }
  c.target_world_m = contact;
  c.unilateral = true;
  c.normal = normal_;
  constraints_.push_back(c);
}

// Walks downhill over neighbours to the point of the surface that is nearest to the instrument.
void EdgeContact::slide_to(const Vec3& contact_world_m) {
  const SurfaceView view = body_.view();
  if (!view.alive(triangle_)) {
    ++searches_;
    const auto closest = body_.tree().closest(view, contact_world_m, kNear_m);
    if (!closest) return;
    triangle_ = closest->triangle;
  }
  const SurfacePoint at = nearest_from(MeshDraft(view.mesh, body_.particle_view()), triangle_, contact_world_m);
  triangle_ = at.triangle;
  bary_ = at.bary;
}

void EdgeContact::enter_tissue(const SurfaceHit& hit) {
  phase_ = Phase::cutting;
  front_.release();
  entry_ = Entry{edge_id_, hit.triangle, hit.bary};
  if (body_.contact.inverse) {
    const SurfacePoint at =
        nearest_from(original_surface(body_), original_triangle(body_, hit.triangle), hit.point_world_m);
    entry_ = Entry{edge_id_, at.triangle, at.bary};
  }
  events_.push_back({EventKind::penetrated});
}

// The place at which the line of a blade first enters the skin, from its heel down to a point.
std::optional<SurfaceHit> EdgeContact::skin_entered(const BladeLine& line, const Vec3& down_to_world_m) const {
  for (const SurfaceHit& hit : body_.tree().hits(body_.view(), line.heel_world_m, down_to_world_m))
    if (hit.entering && body_.mesh.triangle(hit.triangle).surface == Surface::skin) return hit;
  return {};
}

// The triangles that the line of a blade crosses.
void EdgeContact::ask_surface(const Blade& blade, std::vector<TriangleId>& crossed) {
  const BladeLine line = line_of(blade);
  for (const SurfaceHit& hit : body_.tree().hits(body_.view(), line.heel_world_m, line.tip_world_m))
    if (hit.entering) crossed.push_back(hit.triangle);
}

Blade EdgeContact::blade_at(const JointPose& pose) const {
  const InstrumentShape shape = shape_at(pose.opening_rad);
  const EdgeInWorld edge = edge_at(shape, pose);
  Blade blade;
  blade.length_m = (shape.edge_heel_tool_m - shape.edge_tip_tool_m).norm();
  blade.tip_world_m = edge.tip_world_m;
  blade.up_world = edge.up_world;
  return blade;
}

Blade EdgeContact::limited_blade(const JointPose& pose, const Vec3& surface_world_m) const {
  Blade blade = blade_at(pose);
  const double depth_m = (surface_world_m - blade.tip_world_m).dot(blade.up_world);
  if (depth_m > 0)
    blade.max_depth_m = body_.depth_limit_m(blade.tip_world_m + depth_m * blade.up_world, blade.tip_world_m);
  return blade;
}

void EdgeContact::plan(std::span<const JointPose> poses, std::vector<Entry>& entries,
                       std::vector<BladeMotion>& motions) {
  cutting_force_n_.setZero();
  if (phase_ == Phase::spent) rest_in_groove();
  if (body_.frozen && (entry_ || phase_ == Phase::cutting)) return refuse_frozen(motions);
  if (entry_) return begin_stroke(entries, motions);
  if (phase_ != Phase::cutting) return;
  const auto cut = body_.engines.cutting->cut_point(body_.shared(), edge_id_);
  if (cut && body_.cut_traits.edge_cuts_anywhere) return follow_with_whole_edge(*cut, poses, motions);
  if (cut) follow_cut(*cut, poses, motions);
}

void EdgeContact::refuse_frozen(std::vector<BladeMotion>& motions) {
  if (body_.engines.cutting->cut_point(body_.shared(), edge_id_)) motions.push_back({edge_id_, {}, true});
  phase_ = Phase::spent;
  front_.release();
  ended_at_ = point_;
  entry_.reset();
  constraints_.clear();
  events_.push_back({EventKind::cut_refused, "the body is frozen"});
}

void EdgeContact::begin_stroke(std::vector<Entry>& entries, std::vector<BladeMotion>& motions) {
  const SurfaceView view = body_.view();
  const Corners c = view.corners(entry_->triangle);
  point_ = entry_->bary[0] * c[0] + entry_->bary[1] * c[1] + entry_->bary[2] * c[2];
  normal_ = view.normal(entry_->triangle);
  tip_before_ = edge_at(shape_at(pose_.opening_rad), pose_).tip_world_m;
  entries.push_back(*entry_);
  motions.push_back({edge_id_, {limited_blade(pose_, point_)}, false});
  if (body_.cut_traits.edge_cuts_anywhere)
    begin_with_whole_edge(motions.back());
  else
    ask_surface(motions.back().path.back(), motions.back().active);
  entry_.reset();
}

// The decision tree of figure 4, for each pose; the first one that does not cut ends what is cut in this step.
void EdgeContact::follow_cut(const CutPoint& cut, std::span<const JointPose> poses, std::vector<BladeMotion>& motions) {
  if (cut.point_world_m) point_ = *cut.point_world_m;
  const Pose frame = body_.frame_world(cut.near);
  if (cut.normal_body.squaredNorm() > 0.5) normal_ = frame.orientation * cut.normal_body;
  BladeMotion motion{edge_id_, {}, false};
  const std::array resting{pose_};
  Vec3 from = point_;
  double opening_rad = opening_before_rad_;
  for (const JointPose& pose : poses.empty() ? std::span<const JointPose>(resting) : poses) {
    const InstrumentShape shape = shape_at(pose.opening_rad);
    const Jaws jaws = jaws_between(std::exchange(opening_rad, pose.opening_rad), pose.opening_rad);
    const Blade blade = limited_blade(pose, point_);
    const Vec3 travel = blade.tip_world_m - tip_before_;
    Vec3 at_surface;
    double height_m = 0;
    Crossings crossings;
    const auto decide = [&](const Vec3& at_world_m, const Vec3& normal) {
      height_m = height_m_at(at_world_m, normal, blade);
      at_surface = blade.tip_world_m + height_m * blade.up_world;
      crossings = crossings_at(shape, pose, at_world_m, normal);
      const bool over_surface = correct_direction(shape, pose, at_surface - from, normal);
      const bool in_world = correct_direction(shape, pose, travel, normal);
      return instrument_.decide({crossings, over_surface || in_world, jaws});
    };
    CutDecision leaf = decide(point_, normal_);
    // Over a rim, the blade enters another face than the one with the end of its cut.
    if (leaf == CutDecision::detect_again) {
      const BladeLine line = line_of(blade);
      if (const auto skin = skin_entered(line, line.tip_world_m))
        leaf = decide(skin->point_world_m, body_.view().normal(skin->triangle));
    }
    meet_front(shape, pose, frame, instrument_.only_closing && leaf != CutDecision::cut);
    if (leaf == CutDecision::cut) {
      motion.path.push_back(blade);
      ask_surface(blade, motion.active);
      from = at_surface;
      tip_before_ = blade.tip_world_m;
      continue;
    }
    if (leaf == CutDecision::detect_again) {
      motion.lift = height_m < 0 || !crossings.edge || jaws == Jaws::opening;
      break;
    }
    if (leaf == CutDecision::push_out) {
      const double sunk_m = (point_ - pose.to_world(shape.c_tool_m)).dot(normal_);
      const double e_star = body_.spec.material.young_pa / (1 - std::pow(body_.spec.material.poisson, 2));
      const double half_length_m = 0.5 * (shape.c_tool_m - shape.a_tool_m).norm();
      cutting_force_n_ = 2 * e_star * half_length_m * std::max(0.0, sunk_m) * normal_;
    }
    if (!cut.cuts) break;
    if (cut.follows != kNone) take_along(cut.follows, at_surface);
    break;
  }
  motions.push_back(std::move(motion));
}

// A new cut at the end of the old one would go along its walls.
void EdgeContact::rest_in_groove() {
  const InstrumentShape shape = shape_at(pose_.opening_rad);
  const Vec3 tip = pose_.to_world(shape.edge_tip_tool_m), heel = pose_.to_world(shape.edge_heel_tool_m);
  const bool is_out = !body_.tree().inside(body_.view(), tip);
  if (is_out && (tip - ended_at_).dot(normal_) > kLetGo_m) return set_free();
  if (is_out && body_.cut_traits.edge_cuts_anywhere && body_.tree().hits(body_.view(), tip, heel).empty())
    return set_free();
  const Vec3 away = tip - ended_at_;
  if ((away - away.dot(normal_) * normal_).norm() <= 3 * body_.cut_traits.join_tolerance_m) return;
  if (is_out) return void(phase_ = Phase::free);
  if (instrument_.only_closing && !may_enter()) return;
  ++searches_;
  const Vec3 from = instrument_.front_is_virtual ? pose_.to_world(shape.a_tool_m) : heel;
  const auto hit = body_.tree().first_hit(body_.view(), from, tip);
  if (!hit) return set_free();
  if (!hit->entering) return;
  if (opens_from_edge() && shape.sharp_side_tool && !uncut_tissue_at(shape, tip, heel - tip)) return;
  entry_ = Entry{edge_id_, hit->triangle, hit->bary};
  phase_ = Phase::cutting;
  front_.release();
}

void EdgeContact::planned(const CutPlan& plan, bool accepted) {
  if (phase_ != Phase::cutting) return;
  const bool goes_on = accepted && std::ranges::find(plan.going_on, edge_id_) != plan.going_on.end();
  StrokeEnd end = StrokeEnd::going;
  for (const StrokeOutcome& o : plan.outcomes) {
    if (o.edge_id != edge_id_) continue;
    end = o.end;
    if (end == StrokeEnd::joined) events_.push_back({EventKind::joined});
    if (end == StrokeEnd::refused) events_.push_back({EventKind::cut_refused, o.why});
  }
  if (!accepted) events_.push_back({EventKind::cut_refused, "the surface would not stay whole"});
  if (goes_on || (accepted && end == StrokeEnd::going)) return;
  has_just_cut_ = true;
  ended_at_ = point_;
  cutting_force_n_.setZero();
  constraints_.clear();
  const CutTraits& traits = body_.cut_traits;
  if (end == StrokeEnd::lifted && (!traits.edge_cuts_anywhere || traits.cuts_inside)) return set_free();
  phase_ = Phase::spent;
  front_.release();
  if (end == StrokeEnd::lifted || end == StrokeEnd::through) events_.push_back({EventKind::cut_ended});
}

void EdgeContact::let_go() {
  constraints_.clear();
  contact_points_.clear();
  if (phase_ == Phase::pressing) set_free();
}

void EdgeContact::follow(Cause cause, std::span<const TriangleId> changed) {
  if (cause == Cause::indented) return;  // contacts are said on the surface without temporary elements
  if (is_round() && phase_ == Phase::pressing) {
    constraints_.clear();
    return approach_round(pose_);
  }
  tracker_.topology_changed(body_.view(), changed);
  if (cause == Cause::cut) return hold_end_again();  // planned() says what became of the strokes
  if (entry_ && !body_.view().alive(entry_->triangle)) entry_.reset();
  std::erase_if(constraints_, [&](const PointConstraint& c) {
    return std::ranges::any_of(
        c.v, [&](VertexId v) { return v != kNone && (v >= body_.mesh.vertex_slots() || !body_.mesh.vertex_alive(v)); });
  });
  if (phase_ == Phase::pressing && !body_.view().alive(triangle_)) set_free();
  if (phase_ == Phase::cutting && !entry_ && !body_.engines.cutting->cut_point(body_.shared(), edge_id_)) {
    ended_at_ = point_;
    phase_ = Phase::spent;
    front_.release();
    cutting_force_n_.setZero();
    constraints_.clear();
    events_.push_back({EventKind::cut_ended});
  }
}

void EdgeContact::deformed(std::span<const Reaction> reactions, double step_s) {
  Reaction reaction;
  for (const Reaction& r : reactions) {
    reaction.force_on_tool_n += r.force_on_tool_n;
    reaction.active |= r.active;
  }
  if (phase_ == Phase::cutting) {
    force_n_ = reaction.force_on_tool_n + cutting_force_n_;
    return;
  }
  if (phase_ != Phase::pressing || constraints_.empty()) return force_n_.setZero(), void();
  force_n_ = reaction.force_on_tool_n;
  const double push_n = std::max(0.0, force_n_.dot(normal_));
  smooth_force_n_ += std::min(1.0, step_s / kForceFilter_s) * (push_n - smooth_force_n_);
  if (is_round()) return round_deformed(reactions);
  const PointConstraint& c = constraints_.front();
  point_.setZero();
  for (std::size_t i = 0; i < 3; ++i)
    if (c.v[i] != kNone) point_ += c.w[i] * body_.particle_view().position(c.v[i]);
  const double above_m = (c.target_world_m - point_).dot(normal_);
  if (!reaction.active && above_m > kLetGo_m) return set_free();
  const Vec3 home = body_.home_world_m(c.v, {c.w[0], c.w[1], c.w[2]});
  const double displacement_m = (home - c.target_world_m).dot(normal_);
  if (is_blunt() && displacement_m > kDeepDent_m && deep_steps_++ % kLookThroughEvery == 0 &&
      is_pushed_through(c.target_world_m))
    return slip_off();
  // The progressive style cuts from the skin: a wall belongs to the cut above it, into which the blade must come.
  const bool can_begin = body_.cut_traits.edge_cuts_anywhere || body_.mesh.triangle(triangle_).surface == Surface::skin;
  // A tip that is drawn out of tissue, or past its rim, comes from within.
  const bool is_from_within = opens_from_edge() && normal_.dot(blade_at(pose_).up_world) <= 0;
  const bool tip_presses = at_tip_ && instrument_.tip_pierces && !is_from_within;
  const bool may_rupture = can_begin && (tip_presses || sharp_edge_presses());
  if (sharp_edge_is_in_slit() ||
      (may_rupture && ruptures(threshold_, smooth_force_n_, displacement_m, has_just_cut_))) {
    break_in({edge_id_, triangle_, bary_});
  }
}

double EdgeContact::penetration_m() {
  if (phase_ == Phase::cutting)
    if (const auto cut = body_.engines.cutting->cut_point(body_.shared(), edge_id_)) return cut->owed_m;
  if (phase_ != Phase::pressing) return 0;
  const Vec3 contact = contact_world_m();
  if (body_.contact_by_templates()) return beneath_temporary_m(contact);
  if (is_round()) return std::max(0.0, std::ranges::max(samples_, {}, &SurfaceSample::depth_m).depth_m);
  slide_to(contact);
  const Corners c = body_.view().corners(triangle_);
  const Vec3 nearest = bary_[0] * c[0] + bary_[1] * c[1] + bary_[2] * c[2];
  return std::max(0.0, (nearest - contact).dot(body_.view().normal(triangle_)));
}

}  // namespace sectio
