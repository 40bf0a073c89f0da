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
#include "sim_server/instruments/instrument.h"
#include "sim_server/step/step_io.h"
#include "sim_server/world/blade_front.h"
#include "sim_server/world/body.h"
#include "sim_server/world/surface_samples.h"

namespace sectio {

struct ContactEvent {
  EventKind kind;
  std::string_view text = {};  // a constant
};

class EdgeContact {
 public:
  // `edge_id`: the index by which cutting knows the edge. `cuts`: the body can be cut.
  EdgeContact(std::uint32_t edge_id, const ToolSpec& tool, std::size_t edge, Body& body, bool cuts, double step_s);

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
  void deformed(std::span<const Reaction> reactions, double step_s);

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
  std::uint64_t global_searches() const { return tracker_.counters().global_searches + searches_; }

  // The events since the last call.
  std::vector<ContactEvent> take_events();
  // Cuts that were refused before anything was planned, since the last call.
  std::uint32_t take_refused() { return std::exchange(refused_, 0); }
  double cutting_work_j() const { return cutting_work_j_; }  // of the hand against fronts, so far

 private:
  static constexpr double kLetGo_m = 5e-4;      // this far above the surface a contact ends
  static constexpr double kBeneath_m = 3e-4;    // there is tissue this far beneath, or ahead of, what presses
  static constexpr double kDeepDent_m = 0.005;  // a dent from which on an instrument may have gone through
  static constexpr int kLookThroughEvery = 8;   // steps
  static constexpr double kNear_m = 0.02;       // an instrument further from the body's box than this is not looked at

  enum class Phase : std::uint8_t {
    free,
    pressing,  // a point of the instrument dents the surface
    cutting,   // in the tissue: a stroke follows the blade
    spent,     // in the tissue, but a cut has just ended here; no new one until the instrument has gone on
    through,   // it was pushed right through, and the skin slipped off: nothing until it is out of the body
  };

  bool touches() const { return phase_ != Phase::free && phase_ != Phase::through; }
  // A sharp edge that is pushed in deep breaks in; skin slips off what is blunt.
  bool is_blunt() const;
  // A blunt instrument with a radius: edge_contact_round.cpp.
  bool is_round() const;
  std::vector<MovingCapsule> round_parts(const JointPose& before) const;
  void approach_round(const JointPose& before);
  void hold_samples();
  void stand_at(const SurfaceSample& sample);
  void round_deformed(std::span<const Reaction> reactions);
  bool is_pushed_through(const Vec3& tip_world_m) const;
  void slip_off();
  bool is_clear_of_body() const;
  bool near_body(const std::optional<JointPose>& before, std::span<const JointPose> poses) const;
  void look_for_contact(const ToolContact& contact);
  std::optional<SurfaceHit> edge_reaching_in(const ToolContact& contact, const InstrumentShape& shape) const;
  // Presses at a point of the line between two corners.
  void press_at(const SurfaceHit& hit, const std::array<std::size_t, 2>& corners, double along, bool at_tip);
  Vec3 contact_world_m() const;
  void press();
  void press_with_templates(const Vec3& contact_world_m);
  std::vector<std::size_t> corners_beside_contact() const;
  double beneath_temporary_m(const Vec3& contact_world_m) const;
  void slide_to(const Vec3& contact_world_m);
  void enter_tissue(const SurfaceHit& hit);
  void break_in(const Entry& at);
  bool enter_open_cut();
  bool enter_from_above(const Entry& at);
  std::optional<SurfaceHit> skin_entered(const BladeLine& line, const Vec3& down_to_world_m) const;
  void ask_surface(const Blade& blade, std::vector<TriangleId>& crossed);
  void refuse_frozen(std::vector<BladeMotion>& motions);
  void begin_stroke(std::vector<Entry>& entries, std::vector<BladeMotion>& motions);
  void follow_cut(const CutPoint& cut, std::span<const JointPose> poses, std::vector<BladeMotion>& motions);
  // An edge that cuts anywhere along its length (CutTraits): edge_contact_whole_edge.cpp.
  static constexpr double kNoTravel_m = 1e-7;  // a motion below this has no direction
  bool sharp_edge_touches(const InstrumentShape& shape) const;
  // The edge opens a surface wherever it is, and leaves an opening between two walls.
  bool opens_from_edge() const { return body_.cut_traits.edge_cuts_anywhere && !body_.cut_traits.cuts_inside; }
  bool sharp_edge_presses() const;
  bool sharp_edge_is_in_slit() const;
  bool is_between_walls(const InstrumentShape& shape, const Vec3& at_world_m) const;
  bool is_at_wall(const InstrumentShape& shape, const Vec3& at_world_m) const;
  // Where an edge that moves towards its sharp side has come in so far that it has broken in, whatever its force was.
  std::optional<SurfaceHit> sharp_edge_deep_inside(const JointPose& before) const;
  void say_when_tip_is_outside(const JointPose& before);
  std::optional<SurfaceHit> uncut_tissue_at(const InstrumentShape& shape, const Vec3& tip_world_m,
                                            const Vec3& edge_world_m) const;
  void begin_with_whole_edge(BladeMotion& motion);
  void follow_with_whole_edge(const CutPoint& cut, std::span<const JointPose> poses, std::vector<BladeMotion>& motions);
  CutDecision decide_by_surface(const InstrumentShape& shape, const JointPose& pose, bool correct_direction, Jaws jaws);
  void sweep_over(const std::optional<Blade>& before, BladeMotion& motion);

  // A blade that is further than this from the end of its cut has left it.
  double left_behind_m() const { return 3 * body_.cut_traits.join_tolerance_m; }
  void take_along(VertexId end, const Vec3& to_world_m);
  void hold_end_again();
  void meet_front(const InstrumentShape& shape, const JointPose& pose, const Pose& frame_world, bool loose);
  void rest_in_groove();
  Blade blade_at(const JointPose& pose) const;
  Blade limited_blade(const JointPose& pose, const Vec3& surface_world_m) const;
  InstrumentShape shape_at(double opening_rad) const;
  ToolCorners corners_at(const JointPose& pose) const;
  bool may_enter() const;
  void set_free();

  std::uint32_t edge_id_;
  const InstrumentKind& instrument_;
  ToolGeometry geometry_;
  InstrumentState instrument_state_;
  double largest_force_n_, step_s_;
  bool cuts_;
  Body& body_;
  RuptureThreshold threshold_;
  FrontTracker tracker_;

  Phase phase_ = Phase::free;
  JointPose pose_;
  double opening_before_rad_ = 0;                 // at the end of the last step
  std::array<std::size_t, 2> contact_corners_{};  // the point that presses is between these
  double contact_along_ = 0;
  bool at_tip_ = false;          // only the tip breaks the surface
  TriangleId triangle_ = kNone;  // under that point
  Vec3 bary_ = Vec3::Zero();
  Vec3 point_ = Vec3::Zero(), normal_ = Vec3::UnitZ();
  std::vector<PointConstraint> constraints_;
  std::vector<SurfaceSample> samples_;  // that a round instrument holds: one a constraint
  std::vector<ContactPoint> contact_points_;
  std::optional<Entry> entry_;
  Vec3 force_n_ = Vec3::Zero();
  double cutting_work_j_ = 0;
  BladeFront front_;
  Eigen::Quaterniond front_frame_ = Eigen::Quaterniond::Identity();  // from rest to the world
  Vec3 cutting_force_n_ = Vec3::Zero();
  Vec3 tip_before_ = Vec3::Zero();  // of the blade
  double smooth_force_n_ = 0;
  int deep_steps_ = 0;            // in which the instrument pressed deep
  Vec3 ended_at_ = Vec3::Zero();  // where the last cut ended
  std::uint64_t searches_ = 0;
  bool has_just_cut_ = false;
  bool said_tip_is_outside_ = false;  // in this contact
  std::uint32_t refused_ = 0;
  std::vector<ContactEvent> events_;
};

}  // namespace sectio
