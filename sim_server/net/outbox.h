// What the simulation has put down and the publishing thread not yet picked up: bounded, and so that nothing is missed
// but events beyond its limit. Plain values; whoever shares one has the lock. Buffers keep their memory.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/mesh/triangle_mesh.h"
#include "common/messages/session.h"
#include "sim_server/net/state_encoder.h"
#include "sim_server/step/step_io.h"

namespace sectio {

// What the outbox may copy of the simulation's world. Spans are read during put() only.
struct WorldView {
  struct Body {
    const TriangleMesh* mesh = nullptr;
    std::span<const Vec3f> positions_world_m;  // one entry a vertex slot
  };
  std::vector<Body> bodies;
  std::vector<std::optional<JointPose>> tool_poses_world;
};

struct Outbox {
  // After a step. `infos`: of all bodies, the new ones included. The state is copied when it is due, and with deltas.
  void put(const StepOutput& output, const WorldView& world, std::span<const BodyInfo> infos, double step_wall_time_s,
           bool state_due);
  // Must not lie until the next look.
  bool urgent() const;
  // Takes over the numbers of the one that has been picked up: they hold until there are newer ones.
  void go_on_from(const Outbox& picked_up);
  // After all of it has been sent.
  void clear();

  std::vector<std::pair<BodyInfo, TriangleMesh>> new_bodies;
  std::vector<BodyDelta> deltas;
  std::size_t edits = 0;
  // Instead of deltas, when there were too many: the bodies as they were then. Deltas above come after.
  std::optional<std::vector<TriangleMesh>> meshes;
  std::vector<Event> events;
  std::vector<ContactModel> contacts;  // the newest of each tool
  StateSnapshot snapshot;
  bool snapshot_fresh = false;
  bool snapshot_due = false;  // now, out of the rhythm or in it; otherwise with the next one
  StepReport report;
  std::uint64_t step = 0;
  std::uint64_t samples_refused = 0;
  Vec3 gravity_target_m_per_s2 = Vec3::Zero();
  std::optional<std::string> end_reason;
};

}  // namespace sectio
