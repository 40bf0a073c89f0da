// The contact of one edge of an instrument with one body: from free motion over contact to penetration and back (paper
// B, section 2: contact, penetration and termination states).
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "sim_server/collision/front_tracker.h"
#include "sim_server/haptics/contact_model_fitter.h"
#include "sim_server/world/body.h"
#include "sim_server/world/edge_meets_body.h"
#include "sim_server/world/edge_stroke.h"
#include "sim_server/world/instrument_edge.h"
#include "sim_server/world/press_point.h"
#include "sim_server/world/round_contact.h"
#include "sim_server/world/rupture_gauge.h"
#include "sim_server/world/step_io.h"

namespace sectio {

struct ContactEvent {
  EventKind kind;
  std::string_view text = {};  // a constant

  template <class A>
  void archive(A& a) {
    a(kind, text);
  }
};

class EdgeContact {
 public:
  EdgeContact(const InstrumentEdge& edge, Body& body, double step_s);

  // Called before approach() when the instrument comes into the scene. One that comes in the body, and not through its
  // surface, is not felt and cuts nothing until it has been clear of it.
  void arrive() { is_unfelt_ = arrives_ = true; }
  // A part has come off around it.
  void arrive_with(const EdgeContact& parent) { is_unfelt_ = parent.is_unfelt_; }
  // Called before planning; follows the poses since the last step. No poses: the instrument rests.
  void approach(const std::optional<JointPose>& before, std::span<const JointPose> poses, bool continuous);
  // Appends the edge's wishes for plan_cut().
  void plan(std::span<const JointPose> poses, std::vector<Entry>& entries, std::vector<BladeMotion>& motions);
  // Takes the outcome of the plan.
  void planned(const CutPlan& plan, bool accepted);
  // Ends the contact, because the instrument holds the body now and presses it no more.
  void let_go();
  // Follows a change of the body's topology. Contacts with a part that has left end.
  void follow(Cause cause, std::span<const TriangleId> changed);
  // The edge cuts, or looks for a place to cut: temporary elements must be gone before plan().
  bool is_at_work() const { return touches() && phase_ != Phase::pressing; }
  // The points at which the edge presses on a body with contact templates, the most important first.
  std::span<const ContactPoint> contact_points() const { return contact_points_; }
  // Takes the particles that have been made of these points.
  void hold_particles(std::span<const HeldParticle> held);
  // The constraints on the surface in this step; none while free or cutting.
  std::span<const PointConstraint> constraints() const { return constraints_; }
  // Called after the step, with one reaction a constraint, or none.
  void deformed(std::span<const Reaction> reactions);

  ContactState state() const;
  const Vec3& force_on_tool_n() const { return force_n_; }
  // The front of the cut that holds the blade, in the world.
  FeltFront front() const;
  // The instrument's point on the surface, and the normal there; unknown while free.
  bool surface_known() const { return touches(); }
  const Vec3& point_world_m() const { return point_; }
  const Vec3& normal_world() const { return normal_; }
  std::uint32_t body_id() const { return body_.id; }
  // The depth of the pressing point beneath the nearest triangle, after the step, whatever the constraint was.
  double penetration_m();
  ContactGap gap();
  std::uint64_t local_searches() const { return tracker_.counters().local_searches; }
  std::uint64_t global_searches() const {
    return tracker_.counters().global_searches + press_.searches() + groove_searches_;
  }

  // The events since the last call.
  std::vector<ContactEvent> take_events() { return std::exchange(events_, {}); }
  double cutting_work_j() const { return stroke_.resistance().work_j(); }  // work by the hand against fronts so far

  template <class A>
  void archive(A& a) {
    a(edge_, opening_before_rad_, phase_, tracker_, press_, round_, rupture_, entry_, came_in_sideways_,
      came_sideways_m_, stroke_, ended_at_, deep_steps_, steps_beneath_, groove_searches_, was_clear_, point_, normal_,
      contact_points_, constraints_, force_n_, said_no_cut_, is_unfelt_, arrives_, events_);
  }

 private:
  enum class Phase : std::uint8_t {
    free,
    pressing,  // a point of the instrument dents the surface
    cutting,   // in the tissue: a stroke follows the blade
    spent,     // in the tissue, but a cut has just ended here; no new one until the instrument has gone on
    through,   // it was pushed right through, and the skin slipped off: nothing until it is out of the body
  };
  bool touches() const { return phase_ != Phase::free && phase_ != Phase::through; }
  bool is_round() const { return RoundContact::is_for(body_, edge_); }
  // The body can be cut.
  bool cuts() const { return body_.deforms(); }
  bool is_in_whole() const;
  // The edge begins to cut as soon as it reaches into tissue.
  bool may_enter() const;
  bool is_between_halves() const;

  // From one phase to another.
  void set_free();
  void begin_pressing();
  enum class Way : std::uint8_t { tip_first, sideways };
  Way as_it_presses() const { return press_.on_tool().at_tip ? Way::tip_first : Way::sideways; }
  void enter(const Entry& at, Way way);
  void break_in(const Entry& at, Way way);
  void end_cut();
  void slip_off(std::string_view why);

  // Free, or pressing.
  void look_along(const JointPose& before, std::span<const JointPose> poses, bool continuous);
  void look_between_blades();
  void look_for_contact(const ToolContact& contact);
  Entry entry_at(const SurfaceHit& hit) const;
  bool enter_open_cut();
  void say_when_tip_is_outside(const JointPose& before);

  // Pressing.
  void press();
  void press_round(const Pose& before);
  void stand_at(const SurfaceSample& sample);
  void pressed(bool is_active);
  void pressed_round(std::span<const Reaction> reactions);
  bool is_beneath_skin();
  bool slips_through(double displacement_m, const Vec3& ahead_world_m);
  bool breaks_surface(double displacement_m);

  // In the tissue.
  void begin_stroke(std::vector<Entry>& entries, std::vector<BladeMotion>& motions);
  void follow_stroke(const CutPoint& cut, std::span<const JointPose> poses, std::vector<BladeMotion>& motions);
  void leave(std::vector<BladeMotion>& motions);
  void refuse_frozen(std::vector<BladeMotion>& motions);
  void hold_end_again();
  void rest_in_groove();
  double from_end_m() const;  // the tip, along the surface, from where the last cut ended
  std::optional<CutPoint> cut_point() const { return body_.engines.cutting->cut_point(body_.shared(), edge_.id()); }

  InstrumentEdge edge_;  // now
  Body& body_;
  double step_s_;
  double opening_before_rad_ = 0;  // at the end of the last step

  Phase phase_ = Phase::free;
  FrontTracker tracker_;
  PressPoint press_;
  RoundContact round_;
  RuptureGauge rupture_;
  std::optional<Entry> entry_;     // a stroke begins here in this step
  bool came_in_sideways_ = false;  // it began sideways rather than with the tip first
  double came_sideways_m_ = 0;     // how far the edge has gone towards its sharp side since it was clear of the body
  EdgeStroke stroke_;
  std::string_view why_lifted_ = EdgeStroke::kLifted;  // in this step; a constant
  std::optional<Pose> slips_off_;  // tissue with this frame slips off the edge in this step, which ends the stroke
  Vec3 ended_at_ = Vec3::Zero();   // the last cut ended here
  int deep_steps_ = 0;             // steps in which the instrument pressed deep
  int steps_beneath_ = 0;          // steps, one after the other, in which the skin was above all of its ball
  std::uint64_t groove_searches_ = 0;
  bool was_clear_ = true;  // it has been out of the body since it last cut through

  Vec3 point_ = Vec3::Zero(), normal_ = Vec3::UnitZ();
  std::vector<ContactPoint> contact_points_;
  std::vector<PointConstraint> constraints_;
  Vec3 force_n_ = Vec3::Zero();

  bool said_no_cut_ = false;                  // in this contact
  bool is_unfelt_ = false, arrives_ = false;  // it came into the scene in the body; in this step
  std::vector<ContactEvent> events_;
};

}  // namespace sectio
