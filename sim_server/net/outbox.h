// Changes that the simulation put down and the network's thread has not yet picked up. The box is bounded; beyond it,
// deltas are replaced by whole bodies, and events are left out. Plain values, shared under the lock of Handover.
// Buffers keep their memory.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/math/positions_view.h"
#include "common/mesh/triangle_mesh.h"
#include "common/messages/inputs.h"
#include "common/messages/session.h"
#include "sim_server/net/state_encoder.h"
#include "sim_server/world/step_io.h"

namespace sectio {

// The part of the simulation's world that the outbox may copy. Spans are read during put() only.
struct WorldView {
  struct Body {
    const TriangleMesh* mesh = nullptr;
    PositionsView positions_world_m;  // one entry a vertex slot
  };
  std::vector<Body> bodies;
  std::vector<std::optional<JointPose>> tool_poses_world;
  bool in_contact = false;  // any instrument; the contacts of a step say so, too
  // The numbers for each vertex that engines publish of a body. Asked only when a state is copied.
  std::function<std::vector<ScalarField>(std::uint32_t body_id)> scalars = {};
};

struct Outbox {
  // Call after a step. `infos`: one for each body, new ones included. The state is copied when it is due, and with
  // deltas.
  void put(const StepOutput& output, const WorldView& world, std::span<const BodyInfo> infos, double step_wall_time_s,
           bool state_due);
  // The network's thread must be woken for it.
  bool urgent() const;
  // Takes over the numbers of the outbox that has been picked up: they hold until there are newer ones.
  void go_on_from(const Outbox& picked_up);
  // A term begins after this step: what steps after it were told belongs to a former one.
  void begin_term_after(std::uint64_t last_step);
  // Call after all of it has been sent.
  void clear();

  std::vector<StepRecord> inputs;  // inputs of the steps whose outputs are below
  std::vector<std::pair<BodyInfo, TriangleMesh>> new_bodies;
  std::vector<BodyDelta> deltas;
  std::size_t edits = 0;
  // When there were too many deltas: the bodies as they were then. The deltas above come after them.
  std::optional<std::vector<TriangleMesh>> meshes;
  std::vector<Event> events;
  std::vector<ContactModel> contacts;  // the newest of each tool, for a record; hands get them by ContactSender
  StateSnapshot snapshot;
  bool snapshot_fresh = false;
  bool snapshot_due = false;  // to be sent at once; else in the rhythm of states
  StepReport report;
  std::uint64_t step = 0;
  std::uint64_t samples_refused = 0;
  Vec3 gravity_target_m_per_s2 = Vec3::Zero();
  double speed = 1, speed_set = 1;  // now, and when it isn't paused
  double ends_s = 0;                // a record that is played ends there; 0: live
  std::uint32_t frozen_tools = 0;
  std::optional<std::string> end_reason;
};

}  // namespace sectio
