#include "sim_server/world/edge_contact.h"

#include <algorithm>
#include <array>
#include <utility>

#include "sim_server/surface/indentation/contact_places.h"
#include "sim_server/world/indentation.h"
#include "sim_server/world/whole_edge.h"

namespace sectio {
namespace {

constexpr double kPressedIn_m = 0.005;  // the side of a body that an edge has pressed in is so far further back
constexpr double kLetGo_m = 5e-4;       // this far above the surface a contact ends
constexpr double kBeneath_m = 3e-4;     // there is tissue this far ahead of what presses
constexpr const char* kPushedThrough = "it was pushed through, and the skin slipped off";
constexpr const char* kPressedTooFar = "it was pressed in further than the skin gives way, and the skin slipped off";
constexpr const char* kThroughWhole = "a part that moves as a whole isn't cut: the blade goes through it";
constexpr const char* kCameInside =
    "the instrument came into the scene inside the body, and isn't felt until it has been out";
constexpr double kDeepDent_m = 0.005;  // a dent from which on an instrument may have gone through
constexpr int kLookThroughEvery = 8;   // steps
constexpr int kBeneathSteps = 3;       // however long a step is
constexpr double kBeneath_s = 0.02;    // a blow may get so far ahead of the skin for less
constexpr double kGoneOn = 3;          // join tolerances: this far from the end of a cut a new one may begin

RuptureThreshold threshold_of(const CuttingSpec& cutting) {
  return {cutting.threshold_force_n, cutting.threshold_displacement_m, cutting.hysteresis};
}

// The depth of a point beneath the temporary elements about a vertex.
double beneath_temporary_m(Body& body, VertexId about, const Vec3& point_world_m) {
  const MeshDraft surface(body.mesh, body.particle_view());
  const SurfacePoint at = nearest_from(surface, surface.incident(about), point_world_m);
  const Corners c = body.view().corners(at.triangle);
  const Vec3 nearest = at.bary[0] * c[0] + at.bary[1] * c[1] + at.bary[2] * c[2];
  return std::max(0.0, (nearest - point_world_m).dot((c[1] - c[0]).cross(c[2] - c[0]).stableNormalized()));
}

}  // namespace

EdgeContact::EdgeContact(const InstrumentEdge& edge, Body& body, double step_s)
    : edge_(edge),
      body_(body),
      step_s_(step_s),
      rupture_(threshold_of(body.spec.cutting)),
      was_clear_(!body.engines.cutting->has_come_apart()) {}

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

FeltFront EdgeContact::front() const {
  return phase_ == Phase::cutting ? stroke_.resistance().front(edge_.kind(), step_s_) : FeltFront{};
}

bool EdgeContact::may_enter() const {
  return cuts() && edge_.kind().may_enter(jaws_between(opening_before_rad_, edge_.pose().opening_rad));
}

// A blade that has cut a part off is between the halves until it has been clear of both.
bool EdgeContact::is_between_halves() const {
  return !was_clear_ && body_.engines.cutting->has_come_apart();
}

void EdgeContact::set_free() {
  if (phase_ == Phase::pressing) events_.push_back({EventKind::contact_ended});
  if (phase_ == Phase::cutting) events_.push_back({EventKind::cut_ended, why_lifted_});
  phase_ = Phase::free;
  said_no_cut_ = false;
  stroke_.resistance().release();
  force_n_.setZero();
  rupture_.release();
}

void EdgeContact::begin_pressing() {
  if (phase_ == Phase::free) events_.push_back({EventKind::contact_began});
  phase_ = Phase::pressing;
}

void EdgeContact::enter(const Entry& at, Way way) {
  entry_ = at;
  came_in_sideways_ = way == Way::sideways;
  phase_ = Phase::cutting;
  stroke_.resistance().release();
}

void EdgeContact::break_in(const Entry& at, Way way) {
  enter(at, way);
  rupture_.release();
  constraints_.clear();
  events_.push_back({EventKind::penetrated});
}

void EdgeContact::end_cut() {
  phase_ = Phase::spent;
  ended_at_ = point_;
  stroke_.resistance().release();
  constraints_.clear();
}

void EdgeContact::slip_off(std::string_view why) {
  events_.push_back({phase_ == Phase::cutting ? EventKind::cut_ended : EventKind::contact_ended, why});
  constraints_.clear();
  stroke_.resistance().release();
  phase_ = Phase::through;
  force_n_.setZero();
  rupture_.release();
}

void EdgeContact::approach(const std::optional<JointPose>& before, std::span<const JointPose> poses, bool continuous) {
  constraints_.clear();
  contact_points_.clear();
  if (before || !poses.empty()) edge_ = edge_.at(poses.empty() ? *before : poses.back());
  opening_before_rad_ = before ? before->opening_rad : edge_.pose().opening_rad;
  if (is_unfelt_) {
    is_unfelt_ = !is_clear_of(body_, edge_);
    if (std::exchange(arrives_, false) && is_unfelt_) events_.push_back({EventKind::did_not_cut, kCameInside});
    if (is_unfelt_) return;
  }
  if (phase_ == Phase::through && is_clear_of(body_, edge_)) phase_ = Phase::free, tracker_.reset();
  if (const auto sharp_side = edge_.sharp_side_world(); sharp_side && before)
    came_sideways_m_ += std::max(0.0, sharp_side->dot(edge_.tip_world_m() - edge_.at(*before).tip_world_m()));
  if (is_round()) return press_round(before && continuous ? *before : edge_.pose());
  if (is_between_halves()) was_clear_ = is_clear_of(body_, edge_) && !is_beside_wall(body_, edge_);
  const bool looks = phase_ == Phase::free || (phase_ == Phase::pressing && !press_.on_tool().at_tip);
  if (looks && !is_near(body_, edge_, before, poses)) {
    tracker_.reset();
    came_sideways_m_ = 0;
    rupture_.set_just_cut(false);
    if (phase_ == Phase::pressing) set_free();
    return;
  }
  if (looks && edge_.kind().only_closing && body_.cut_traits.edge_cuts_anywhere) look_between_blades();
  if (looks && before) look_along(*before, poses, continuous);
  if ((phase_ == Phase::free || phase_ == Phase::pressing) && enter_open_cut()) return;
  if (phase_ == Phase::pressing) press();
  if (!before) return;
  if (looks) say_when_tip_is_outside(*before);
  // Also while the tip touches a wall of the cut that the blade is in.
  if (phase_ != Phase::cutting && body_.cut_traits.edge_cuts_anywhere && cuts() && !is_between_halves())
    if (const auto hit = sharp_edge_deep_inside(body_, edge_, *before)) {
      break_in({edge_.id(), hit->triangle, hit->bary}, Way::sideways);
    }
}

// Blades that are open about tissue, which the lower one isn't in, close on it from there.
void EdgeContact::look_between_blades() {
  const double opening_rad = edge_.pose().opening_rad;
  if (lower_blade_is_clear_of(body_, edge_)) {
    if (opening_rad >= opening_before_rad_) edge_ = edge_.closing_from(opening_rad);
  } else if (body_.tree().inside(body_.view(), edge_.corners().at_world_m[0])) {
    edge_ = edge_.closing_from(0);
  }
}

void EdgeContact::look_along(const JointPose& before, std::span<const JointPose> poses, bool continuous) {
  ToolCorners from = edge_.at(before).corners();
  const std::array resting{edge_.pose()};  // the surface may come to an instrument that rests
  for (const JointPose& pose : poses.empty() ? std::span<const JointPose>(resting) : poses) {
    const ToolCorners to = edge_.at(pose).corners();
    look_for_contact(tracker_.follow(body_.view(), body_.tree(), {from, to, continuous}));
    from = to;
    if (phase_ != Phase::free) break;
  }
}

void EdgeContact::look_for_contact(const ToolContact& contact) {
  if (may_enter())
    if (const auto hit = reaches_in(body_, edge_, contact)) {
      enter(entry_at(*hit), as_it_presses());
      events_.push_back({EventKind::penetrated});
      return;
    }
  auto pressing = tip_presses(edge_.kind(), contact);
  if (!pressing && phase_ != Phase::pressing) pressing = side_presses(edge_.kind(), contact);
  if (!pressing) return;
  begin_pressing();
  press_.begin(body_, pressing->on_tool, pressing->hit);
}

// On the surface without temporary elements.
Entry EdgeContact::entry_at(const SurfaceHit& hit) const {
  if (!body_.contact.inverse) return {edge_.id(), hit.triangle, hit.bary};
  const SurfacePoint at =
      nearest_from(original_surface(body_), original_triangle(body_, hit.triangle), hit.point_world_m);
  return {edge_.id(), at.triangle, at.bary};
}

// A blade that comes between the lips of a cut is in the tissue, without a force.
bool EdgeContact::enter_open_cut() {
  const bool may_cut = cuts() && (edge_.kind().tip_pierces || may_enter());
  if (!may_cut || body_.rigid() || body_.cut_traits.edge_cuts_anywhere) return false;
  std::optional<TriangleId> wall;
  if (phase_ == Phase::pressing && body_.mesh.triangle(press_.triangle()).surface == Surface::wall)
    wall = press_.triangle();
  const auto entry = enters_open_cut(body_, edge_, wall);
  if (!entry) return false;
  if (phase_ == Phase::pressing) events_.push_back({EventKind::contact_ended});
  break_in(*entry, as_it_presses());
  return true;
}

// A style that cuts where the tip goes has no cut for a blade that goes through the body beside its tip. Nothing was
// begun, so nothing is refused: a hand that grazes tissue is told, and may go on.
void EdgeContact::say_when_tip_is_outside(const JointPose& before) {
  if (said_no_cut_ || phase_ != Phase::pressing || body_.cut_traits.edge_cuts_anywhere || body_.rigid()) return;
  if (!cuts() || body_.tree().inside(body_.view(), edge_.tip_world_m())) return;
  if (!sharp_edge_deep_inside(body_, edge_, before) || tip_is_in_groove(body_, edge_)) return;
  said_no_cut_ = true;
  events_.push_back({EventKind::did_not_cut, "the edge went in, but the tip, which cuts in this style, is outside"});
}

void EdgeContact::press() {
  if (body_.contact_by_templates()) {
    contact_points_ = press_.press_with_templates(body_, edge_);
    if (!contact_points_.empty()) normal_ = contact_points_.front().normal_world;
    return;
  }
  const auto constraint = press_.press(body_, edge_);
  if (!constraint) return set_free();
  normal_ = constraint->normal;
  constraints_.push_back(*constraint);
}

void EdgeContact::press_round(const Pose& before) {
  if (phase_ == Phase::through) return;
  const auto deepest = round_.press(body_, edge_, before, phase_ == Phase::pressing ? -kLetGo_m : 0);
  if (!deepest) return set_free();
  begin_pressing();
  stand_at(*deepest);
  point_ = deepest->point_world_m;
  constraints_ = round_.constraints(body_, edge_);
}

void EdgeContact::stand_at(const SurfaceSample& sample) {
  press_.stand_at_tip(sample.triangle, sample.bary);
  normal_ = body_.undeformed_normal_world(MeshDraft(body_.mesh, body_.particle_view()),
                                          body_.mesh.triangle(sample.triangle).v, sample.bary);
}

void EdgeContact::hold_particles(std::span<const HeldParticle> held) {
  for (const HeldParticle& h : held) {
    if (h.owner != edge_.id()) continue;
    PointConstraint c = hold(h.vertex, h.target_world_m);
    c.unilateral = c.sticks = true;
    c.normal = normal_;
    constraints_.push_back(c);
  }
}

void EdgeContact::deformed(std::span<const Reaction> reactions) {
  // A step that wasn't solved says nothing of the force, which stays as it was.
  if (std::ranges::any_of(reactions, [](const Reaction& r) { return !r.is_known; })) return;
  Reaction sum;
  for (const Reaction& r : reactions) {
    sum.force_on_tool_n += r.force_on_tool_n;
    sum.active |= r.active;
  }
  if (phase_ == Phase::cutting) {
    force_n_ = sum.force_on_tool_n + stroke_.resistance().force_on_tool_n();
    return;
  }
  if (phase_ != Phase::pressing || constraints_.empty()) return force_n_.setZero(), void();
  force_n_ = sum.force_on_tool_n;
  rupture_.push(std::max(0.0, force_n_.dot(normal_)), step_s_);
  is_round() ? pressed_round(reactions) : pressed(sum.active);
}

void EdgeContact::pressed(bool is_active) {
  const PointConstraint& c = constraints_.front();
  point_ = body_.position_at(c.v, {c.w[0], c.w[1], c.w[2]});
  const double above_m = (c.target_world_m - point_).dot(normal_);
  if (!is_active && above_m > kLetGo_m) return is_in_whole() ? slip_off(kThroughWhole) : set_free();
  const Vec3 undeformed = body_.undeformed_world_m(c.v, {c.w[0], c.w[1], c.w[2]});
  const double displacement_m = (undeformed - c.target_world_m).dot(normal_);
  // A sharp edge that is pushed in deep breaks in; skin slips off what is blunt.
  if (edge_.is_blunt() && slips_through(displacement_m, c.target_world_m - kBeneath_m * normal_))
    return slip_off(kPushedThrough);
  if (!breaks_surface(displacement_m)) return;
  cuts() ? break_in({edge_.id(), press_.triangle(), press_.bary()}, as_it_presses()) : slip_off(kThroughWhole);
}

// A piece that gave way to the blade may have come back over it.
bool EdgeContact::is_in_whole() const {
  return !cuts() && !edge_.is_blunt() && !is_clear_of(body_, edge_);
}

bool EdgeContact::breaks_surface(double displacement_m) {
  if (!cuts()) return !edge_.is_blunt() && !back_presses(edge_, normal_) && rupture_.breaks(displacement_m);
  if (sharp_edge_is_in_slit(body_, edge_, press_)) return true;
  // The progressive style cuts from the skin: a wall belongs to the cut above it, into which the blade must come.
  const bool is_skin = body_.mesh.triangle(press_.triangle()).surface == Surface::skin;
  if (!body_.cut_traits.edge_cuts_anywhere && !is_skin) return false;
  // A tip that is drawn out of tissue, or past its rim, comes from within.
  const bool is_from_within = opens_from_edge(body_.cut_traits) && normal_.dot(edge_.blade().up_world) <= 0;
  const bool tip_breaks =
      press_.on_tool().at_tip && edge_.kind().tip_pierces && !is_from_within && !back_presses(edge_, normal_);
  return (tip_breaks || sharp_edge_presses(body_, edge_, press_, normal_)) && rupture_.breaks(displacement_m);
}

// A ball lies in its dent. Skin that the whole ball is beneath for some time has slipped off it.
bool EdgeContact::is_beneath_skin() {
  steps_beneath_ = round_.depth_m() > 2 * edge_.ball_radius_m() ? steps_beneath_ + 1 : 0;
  return steps_beneath_ > kBeneathSteps && steps_beneath_ * step_s_ > kBeneath_s;
}

// The instrument stands at the middle of what it presses.
void EdgeContact::pressed_round(std::span<const Reaction> reactions) {
  const auto middle = round_.deformed(body_, constraints_, reactions);
  if (!middle) return;
  if (is_beneath_skin()) return slip_off(kPressedTooFar);
  stand_at(middle->nearest);
  point_ = middle->point_world_m;
  const Vec3 undeformed = body_.undeformed_world_m(body_.mesh.triangle(press_.triangle()).v, press_.bary());
  const Vec3 ahead = press_.tool_point_world_m(edge_) - (edge_.ball_radius_m() + kBeneath_m) * normal_;
  if (slips_through((undeformed - middle->nearest.target_world_m).dot(normal_), ahead)) slip_off(kPushedThrough);
}

// There is no tissue ahead of what presses any more.
bool EdgeContact::slips_through(double displacement_m, const Vec3& ahead_world_m) {
  return displacement_m > kDeepDent_m && deep_steps_++ % kLookThroughEvery == 0 &&
         !body_.tree().inside(body_.view(), ahead_world_m);
}

double EdgeContact::penetration_m() {
  if (phase_ == Phase::cutting)
    if (const auto cut = cut_point()) return cut->owed_m;
  if (phase_ == Phase::spent)
    return !is_between_halves() && uncut_tissue_at(body_, edge_, edge_.tip_world_m()) ? from_end_m() : 0;
  if (phase_ != Phase::pressing) return 0;
  if (is_round()) return round_.depth_m();
  if (!body_.contact_by_templates()) return press_.depth_m(body_, edge_);
  if (constraints_.empty()) return 0;
  return beneath_temporary_m(body_, constraints_.front().v[0], press_.tool_point_world_m(edge_));
}

ContactGap EdgeContact::gap() {
  return phase_ == Phase::pressing ? press_.gap(body_, edge_, normal_) : ContactGap{};
}

void EdgeContact::plan(std::span<const JointPose> poses, std::vector<Entry>& entries,
                       std::vector<BladeMotion>& motions) {
  if (is_unfelt_) return leave(motions);
  stroke_.resistance().begin_step(step_s_);
  slips_off_.reset();
  why_lifted_ = EdgeStroke::kLifted;
  if (phase_ == Phase::spent) rest_in_groove();
  if (body_.frozen && (entry_ || phase_ == Phase::cutting)) return refuse_frozen(motions);
  if (entry_) return begin_stroke(entries, motions);
  if (phase_ != Phase::cutting) return;
  if (const auto cut = cut_point()) follow_stroke(*cut, poses, motions);
}

// It is not in anything any more: it was withdrawn.
void EdgeContact::leave(std::vector<BladeMotion>& motions) {
  if (phase_ == Phase::free) return;
  if (cut_point()) motions.push_back({edge_.id(), {}, true});
  set_free();
  entry_.reset(), tracker_.reset();
  came_sideways_m_ = 0;
}

void EdgeContact::refuse_frozen(std::vector<BladeMotion>& motions) {
  if (cut_point()) motions.push_back({edge_.id(), {}, true});
  end_cut();
  entry_.reset();
  events_.push_back({EventKind::cut_refused, "the body is frozen"});
}

void EdgeContact::begin_stroke(std::vector<Entry>& entries, std::vector<BladeMotion>& motions) {
  const SurfaceView view = body_.view();
  const Corners c = view.corners(entry_->triangle);
  point_ = entry_->bary[0] * c[0] + entry_->bary[1] * c[1] + entry_->bary[2] * c[2];
  normal_ = view.normal(entry_->triangle);
  entries.push_back(*entry_);
  motions.push_back(stroke_.begin(body_, edge_, point_, came_in_sideways_ ? came_sideways_m_ + kPressedIn_m : 0));
  entry_.reset();
}

void EdgeContact::follow_stroke(const CutPoint& cut, std::span<const JointPose> poses,
                                std::vector<BladeMotion>& motions) {
  if (cut.point_world_m) point_ = *cut.point_world_m;
  const Pose frame = body_.frame_world(cut.near);
  if (!body_.cut_traits.edge_cuts_anywhere && cut.normal_body.squaredNorm() > 0.5)
    normal_ = frame.orientation * cut.normal_body;
  auto [motion, held, is_sunk, slips, why_lifted] =
      stroke_.follow(body_, {edge_, poses, opening_before_rad_, cut, frame, point_, normal_, step_s_});
  motions.push_back(std::move(motion));
  why_lifted_ = why_lifted;
  if (slips) slips_off_ = frame;
  if (is_sunk && !std::exchange(said_no_cut_, true)) events_.push_back({EventKind::did_not_cut, EdgeStroke::kSunk});
  constraints_ = std::move(held);
}

double EdgeContact::from_end_m() const {
  const Vec3 away = edge_.tip_world_m() - ended_at_;
  return (away - away.dot(normal_) * normal_).norm();
}

// A new cut at the end of the old one would go along its walls.
void EdgeContact::rest_in_groove() {
  const Vec3 tip = edge_.tip_world_m(), heel = edge_.heel_world_m();
  const bool is_out = !body_.tree().inside(body_.view(), tip);
  const Vec3 away = tip - ended_at_;
  if (is_out && away.dot(normal_) > kLetGo_m) return set_free();
  if (is_out && body_.cut_traits.edge_cuts_anywhere && body_.tree().hits(body_.view(), tip, heel).empty())
    return set_free();
  if (from_end_m() <= kGoneOn * body_.cut_traits.join_tolerance_m) return;
  const bool closes_on = edge_.closes_from_rad() > 0 && may_enter();  // its tip is beneath the tissue
  if (is_out && !closes_on) return void(phase_ = Phase::free);
  if (is_out) return;
  if (edge_.kind().only_closing && !may_enter()) return;
  ++groove_searches_;
  const Vec3 from = edge_.kind().front_is_virtual ? edge_.pose().to_world(edge_.shape().a_tool_m) : heel;
  const auto hit = body_.tree().first_hit(body_.view(), from, tip);
  if (!hit) return set_free();
  if (!hit->entering) return;
  if (is_between_halves()) return;
  if (opens_from_edge(body_.cut_traits) && edge_.shape().sharp_side_tool && !uncut_tissue_at(body_, edge_, tip)) return;
  enter({edge_.id(), hit->triangle, hit->bary}, as_it_presses());
}

void EdgeContact::planned(const CutPlan& plan, bool accepted) {
  if (phase_ != Phase::cutting) return;
  const bool goes_on = accepted && std::ranges::find(plan.going_on, edge_.id()) != plan.going_on.end();
  StrokeEnd end = StrokeEnd::going;
  for (const StrokeOutcome& o : plan.outcomes) {
    if (o.edge_id != edge_.id()) continue;
    end = o.end;
    if (end == StrokeEnd::joined) events_.push_back({EventKind::joined});
    if (end == StrokeEnd::refused) events_.push_back({EventKind::cut_refused, o.why});
  }
  if (!accepted) events_.push_back({EventKind::cut_refused, "the surface would not stay whole"});
  if (goes_on || (accepted && end == StrokeEnd::going)) return;
  rupture_.set_just_cut(true);
  constraints_.clear();
  if (const auto frame_world = std::exchange(slips_off_, std::nullopt);
      frame_world && !tip_will_be_in_groove(body_, edge_, *frame_world))
    return slip_off(why_lifted_);
  if (end == StrokeEnd::lifted && !opens_from_edge(body_.cut_traits)) return set_free();
  end_cut();
  if (end == StrokeEnd::lifted) events_.push_back({EventKind::cut_ended, why_lifted_});
  if (end != StrokeEnd::through) return;
  was_clear_ = false;
  events_.push_back({EventKind::cut_ended, EdgeStroke::kLeft});
}

void EdgeContact::let_go() {
  constraints_.clear();
  contact_points_.clear();
  if (phase_ == Phase::pressing) set_free();
}

void EdgeContact::follow(Cause cause, std::span<const TriangleId> changed) {
  const bool entry_is_gone = entry_ && !body_.view().alive(entry_->triangle);
  if (entry_is_gone) entry_.reset();
  if (cause == Cause::indented) {  // contacts are said on the surface without temporary elements, but for an entry
    if (entry_is_gone) set_free();
    return;
  }
  if (is_round() && phase_ == Phase::pressing) {
    constraints_.clear();
    return press_round(edge_.pose());
  }
  tracker_.topology_changed(body_.view(), changed);
  if (cause == Cause::cut) return hold_end_again();  // planned() says what became of the strokes
  std::erase_if(constraints_, [&](const PointConstraint& c) {
    return std::ranges::any_of(
        c.v, [&](VertexId v) { return v != kNone && (v >= body_.mesh.vertex_slots() || !body_.mesh.vertex_alive(v)); });
  });
  if (phase_ == Phase::pressing && !body_.view().alive(press_.triangle())) set_free();
  if (phase_ == Phase::cutting && !entry_ && !cut_point()) {
    end_cut();
    events_.push_back({EventKind::cut_ended, "the tissue around it is gone"});
  }
}

// A cut of another instrument may have made the end of this one anew.
void EdgeContact::hold_end_again() {
  if (phase_ != Phase::cutting || constraints_.empty()) return;
  if (body_.cut_traits.cuts_inside) return void(constraints_ = stroke_.press_again(body_, edge_));
  const auto cut = cut_point();
  if (cut && cut->follows != kNone)
    constraints_.front().v[0] = cut->follows;
  else
    constraints_.clear();
}

}  // namespace sectio
