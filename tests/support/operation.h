// A small organ on the table and instruments in hands that the test moves: the real simulation, sample by sample.
#pragma once

#include <functional>
#include <vector>

#include "sim_server/engine/standard_engines.h"
#include "sim_server/simulation.h"
#include "tests/support/shapes.h"

namespace sectio::test {

constexpr double kOrganTop_m = 0.03;

// An ellipsoid of 120 x 120 x 60 mm and 1280 triangles, held from below, and a scalpel with its sharp side to +x.
Scene organ_scene();

constexpr double kStrokeDepth_m = 0.004;  // below the skin of the organ

double organ_height_m(double x_m, double y_m);

class Operation {
 public:
  static constexpr double kSample_s = 0.001;

  explicit Operation(Scene s, const EngineTable& engines = standard_engines());

  // A step with no news, or with one sample of one or more instruments.
  const StepOutput& step(const std::vector<std::pair<std::uint32_t, Pose>>& poses);
  const StepOutput& step(const StepInput& input);
  ToolSample sample(std::uint32_t tool, const Pose& pose);

  // Straight and evenly, a sample a step; never less than one.
  void move(const Vec3& to_m, double speed_m_per_s = 0.02, std::uint32_t tool = 0);
  // The tip at (x, y), `depth_m` beneath where the skin is when nothing presses.
  void tip_to(double x_m, double y_m, double depth_m, double speed_m_per_s = 0.02, std::uint32_t tool = 0);
  void place(const Vec3& at_m, const Eigen::Quaterniond& orientation = Eigen::Quaterniond::Identity(),
             std::uint32_t tool = 0);
  void rest(int steps);
  const Pose& hand(std::uint32_t tool = 0) const { return hands_[tool].pose; }

  std::size_t count(EventKind kind) const;
  ContactState state(std::uint32_t tool = 0) const { return last.contacts.at(tool).state; }
  Vec3 force_n(std::uint32_t tool = 0) const { return last.contacts.at(tool).force_world_n; }
  const TriangleMesh& mesh(std::uint32_t body = 0) const { return simulation.mesh(body); }
  void expect_valid() const;
  double farthest_from_rest_m() const;  // any vertex of the first body
  // Original edges that a cut has opened: both ends among the vertices of the beginning.
  std::size_t walls() const;

  Scene scene;
  Simulation simulation;
  StepOutput last;
  std::vector<Event> events;
  std::size_t deltas = 0;
  double deepest_m = 0;
  std::function<void(const StepOutput&)> after_each;

 private:
  struct Hand {
    Pose pose;
    std::uint64_t sequence = 0;
  };
  std::vector<Hand> hands_;
};

}  // namespace sectio::test
