#include "sim_server/net/outbox.h"

#include <algorithm>

namespace sectio {
namespace {

constexpr std::size_t kMaxDeltas = 16384;
constexpr std::size_t kMaxEdits = 1u << 21;
constexpr std::size_t kMaxEvents = 4096;

void copy_state(const StepOutput& output, const WorldView& world, double step_wall_time_s, StateSnapshot& snapshot) {
  snapshot.step = output.step;
  snapshot.step_wall_time_s = step_wall_time_s;
  snapshot.in_contact = world.in_contact || std::ranges::any_of(output.contacts, [](const ContactModel& model) {
                          return model.state != ContactState::free;
                        });
  snapshot.gravity_m_per_s2 = output.gravity_m_per_s2;
  snapshot.bodies.resize(world.bodies.size());
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    snapshot.bodies[b].revision = world.bodies[b].mesh->revision();
    snapshot.bodies[b].positions_world_m.assign(world.bodies[b].positions_world_m.begin(),
                                                world.bodies[b].positions_world_m.end());
    snapshot.bodies[b].scalars.clear();
    if (world.scalars) snapshot.bodies[b].scalars = world.scalars(static_cast<std::uint32_t>(b));
  }
  snapshot.tools.resize(world.tool_poses_world.size());
  for (std::size_t t = 0; t < snapshot.tools.size(); ++t) {
    const std::optional<JointPose>& pose = world.tool_poses_world[t];
    snapshot.tools[t] = {pose.has_value(), pose.value_or(JointPose{})};
  }
}

}  // namespace

void Outbox::put(const StepOutput& output, const WorldView& world, std::span<const BodyInfo> infos,
                 double step_wall_time_s, bool state_due) {
  for (const BodyDelta& delta : output.deltas) edits += delta.delta.vertices.size() + delta.delta.triangles.size();
  for (const NewBody& body : output.new_bodies)
    new_bodies.emplace_back(infos[body.body_id], *world.bodies[body.body_id].mesh);
  deltas.insert(deltas.end(), output.deltas.begin(), output.deltas.end());
  if (deltas.size() > kMaxDeltas || edits > kMaxEdits) {
    deltas.clear();
    edits = 0;
    meshes.emplace();
    for (const WorldView::Body& body : world.bodies) meshes->push_back(*body.mesh);
  }
  if (events.size() < kMaxEvents) events.insert(events.end(), output.events.begin(), output.events.end());
  for (const ContactModel& model : output.contacts) {
    const auto same = std::ranges::find(contacts, model.tool_id, &ContactModel::tool_id);
    if (same == contacts.end())
      contacts.push_back(model);
    else
      *same = model;
  }
  // Topology that changed needs a state of its revision, should this be the last step for a while.
  if (state_due || !output.deltas.empty()) {
    copy_state(output, world, step_wall_time_s, snapshot);
    snapshot_fresh = true;
  }
  snapshot_due = snapshot_due || state_due;
  report = output.report;
  step = output.step;
  gravity_target_m_per_s2 = output.gravity_target_m_per_s2;
}

bool Outbox::urgent() const {
  return !new_bodies.empty() || !deltas.empty() || !events.empty() || snapshot_due || end_reason;
}

void Outbox::go_on_from(const Outbox& picked_up) {
  report = picked_up.report;
  step = picked_up.step;
  samples_refused = picked_up.samples_refused;
  gravity_target_m_per_s2 = picked_up.gravity_target_m_per_s2;
  speed = picked_up.speed;
  speed_set = picked_up.speed_set;
  ends_s = picked_up.ends_s;
  frozen_tools = picked_up.frozen_tools;
}

void Outbox::begin_term_after(std::uint64_t last_step) {
  std::erase_if(inputs, [&](const StepRecord& record) { return record.step > last_step; });
  step = last_step;
}

void Outbox::clear() {
  inputs.clear();
  new_bodies.clear();
  deltas.clear();
  edits = 0;
  meshes.reset();
  events.clear();
  contacts.clear();
  snapshot_fresh = snapshot_due = false;
  end_reason.reset();
}

}  // namespace sectio
