// A server's world without a simulation: a closed surface that breathes, and whose triangles are split and healed at
// random. Everything follows from the seed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/delta/topology_delta.h"
#include "common/messages/session.h"
#include "sim_server/net/server_net.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace sectio::test {

// Splits a triangle at its centroid; every result is a closed manifold.
TopologyDelta split_triangle(const TriangleMesh& mesh, TriangleId t);

class MovingWorld {
 public:
  static constexpr double kStep_s = 0.001;

  explicit MovingWorld(int levels = 2, unsigned seed = 1);

  // `cut`: the topology changes too.
  StepOutput step(bool cut);

  WorldView view() const { return {{{&mesh_, positions_}}, {Pose{Vec3(0, 0, static_cast<double>(step_) * 1e-4)}}}; }

  SceneInfo scene(const std::string& session) const;

  const TriangleMesh& mesh() const { return mesh_; }
  const std::vector<Vec3f>& positions() const { return positions_; }
  std::uint64_t steps() const { return step_; }

 private:
  TopologyDelta change();

  // Every vertex moves every step, and says by its height at which step.
  void move();

 public:
  static constexpr float kRise_m = 1e-4f;  // a step: twenty quanta
  // The step at which this position was current.
  static double step_of(const Vec3f& position_m, const Vec3f& rest_m);

 private:
  TriangleMesh mesh_;
  std::vector<Vec3f> positions_;
  test::Random random_;
  std::optional<TopologyDelta> undo_;
  std::uint64_t step_ = 0;
};

}  // namespace sectio::test
