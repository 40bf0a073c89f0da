// The grasp of one instrument's tips (paper C, 3.1). Jaws that close hold a loose piece, or the points of tissue, in
// a sphere that is a little larger than the ball about the tips, which pushes tissue while they are open. Points of
// tissue follow the hand by a force with a cap, and not faster than hands move, so that no motion brings more energy
// than the cap times the path of the tissue; points that are pulled further than the sphere's radius slip out. A
// piece hangs on springs, which give way by the radius at the largest force, and follow the hand no faster, either;
// it slips out a little beyond. So a piece is never stiffer in the hand than force over radius, whatever it is stuck
// in.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "sim_server/instruments/instrument.h"
#include "sim_server/world/body.h"
#include "sim_server/world/step_io.h"

namespace sectio {

struct GraspEvent {
  EventKind kind;  // grasped, released
  std::uint32_t body_id;
  std::string_view text = {};  // why; a constant

  template <class A>
  void archive(A& a) {
    a(kind, body_id, text);
  }
};

class Grasp {
 public:
  explicit Grasp(const ToolSpec& tool);

  // Called at the beginning of a step: jaws close, open or lose their hold. The instrument is at `pose` from then on.
  void follow(const JointPose& pose, std::span<const std::unique_ptr<Body>> bodies, double step_s);
  // The instrument is gone: it holds nothing, and its jaws must open before they close on something again.
  void withdraw();
  // Appends the constraints on the points of a body in this step.
  void append(const Body& body, double step_s, std::vector<PointConstraint>& constraints) const;
  // Takes the reaction of one of these constraints.
  void felt(const Reaction& reaction);

  // Follows a change of a body: vertices that are new or gone are not held.
  void follow(std::uint32_t body_id, const TopologyDelta& delta);
  // Follows a part that came off; by vertex of the part, its slot in the parent. Called before the parent changes.
  void part_left(std::uint32_t parent_id, const Body& part, std::span<const VertexId> vertex_from);

  bool holds(std::uint32_t body_id) const;
  std::optional<std::uint32_t> held_body() const;  // the one that was grasped first
  bool holds_something() const { return !held_.empty(); }
  bool holds_tissue() const { return holds_something() && held_.front().points.front().vertex != kNone; }
  const Vec3& force_on_tool_n() const { return force_on_tool_n_; }  // force of this step
  double stiffness_n_per_m() const { return largest_force_n_ / radius_m_; }
  double largest_force_n() const { return largest_force_n_; }
  const Vec3& velocity_m_per_s() const { return velocity_m_per_s_; }  // the velocity of the held thing
  std::vector<GraspEvent> take_events();                              // since the last call

  template <class A>
  void archive(A& a) {
    a(pose_, springs_at_m_, open_, held_, held_at_m_, velocity_m_per_s_, force_on_tool_n_, known_force_n_, events_);
  }

 private:
  struct Point {
    VertexId vertex = kNone;  // vertex of the tissue; a rigid piece has none
    Vec3 at_piece_m = Vec3::Zero();
    Vec3 at_tool_m = Vec3::Zero();
    double share = 0;  // share of the force; all points' sum is 1

    template <class A>
    void archive(A& a) {
      a(vertex, at_piece_m, at_tool_m, share);
    }
  };
  struct Held {
    std::uint32_t body_id = 0;
    std::vector<Point> points;

    template <class A>
    void archive(A& a) {
      a(body_id, points);
    }
  };

  bool hold_piece(std::span<const std::unique_ptr<Body>> bodies);
  void hold_tissue(std::span<const std::unique_ptr<Body>> bodies);
  static Vec3 place_of(const Point& point, const Body& body);
  Vec3 target_of(const Point& point) const;
  PointConstraint constraint_of(const Point& point, const Body& body, double step_s) const;
  std::vector<Point> points_of_jaws(const Body& piece, double share) const;
  void track(std::span<const std::unique_ptr<Body>> bodies, double step_s);
  void share_out();
  void let_go(std::string_view why);

  const InstrumentKind& instrument_;
  ToolGeometry geometry_;
  double largest_force_n_, radius_m_;
  JointPose pose_;
  Vec3 springs_at_m_ = Vec3::Zero();  // origin of the tool's frame that the springs hang on: it follows the hand
  bool open_ = false;                 // since when there is a pose
  std::vector<Held> held_;
  std::optional<Vec3> held_at_m_;  // the mean place of the held points, while they are the same
  Vec3 velocity_m_per_s_ = Vec3::Zero();
  Vec3 force_on_tool_n_ = Vec3::Zero();
  Vec3 known_force_n_ = Vec3::Zero();  // the last step's; stands for that of a step that was not solved
  std::vector<GraspEvent> events_;
};

}  // namespace sectio
