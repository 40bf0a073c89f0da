#include "sim_server/simulation.h"

#include <utility>

#include "common/core/error.h"
#include "common/math/archive.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/step/step.h"

namespace sectio {

struct Simulation::State {
  State(const Scene& scene, const EngineTable& engines) : world(scene, engines) {}

  void archive(Archive& a) {
    a(output.step, output.sim_time_s, output.gravity_m_per_s2, output.gravity_target_m_per_s2, output.report, world);
  }

  SimulatedWorld world;
  StepOutput output;
  double (*processor_s)() = nullptr;
  std::size_t saved_bytes = 0;  // the last time
};

Simulation::Simulation(const Scene& scene) : Simulation(scene, standard_engines()) {}
Simulation::Simulation(const Scene& scene, const EngineTable& engines)
    : state_(std::make_unique<State>(scene, engines)) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

const StepOutput& Simulation::step(const StepInput& input) {
  SimulatedWorld& world = state_->world;
  StepOutput& output = state_->output;
  begin_step(output, world.scene.step_s);
  StepContext context(input, output, world.bodies.size(), state_->processor_s);
  if (!input.overrun.empty()) context.emit(EventKind::step_overrun, 0, 0, input.overrun);

  take_samples(world, context);
  grasp(world, context);
  tilt(world, context);
  touch(world, context);
  cut(world, context);
  tidy(world, context);
  split(world, context);
  indent(world, context);
  spare(world, context);
  meet(world, context);
  deform(world, context);
  watch(world, context);
  interact(world, context);
  collide(world, context);
  guard(world, context);
  feel(world, context);
  report(world, context);
  return output;
}

std::optional<std::vector<std::uint8_t>> Simulation::save() const {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(state_->saved_bytes + state_->saved_bytes / 8);
  Archive archive(bytes);
  state_->archive(archive);
  if (archive.refused()) return std::nullopt;
  state_->saved_bytes = bytes.size();
  return bytes;
}

void Simulation::load(std::span<const std::uint8_t> state) {
  Archive archive(state);
  state_->archive(archive);
  if (archive.remaining() > 0) throw InputError("the state doesn't end where it should");
}

void Simulation::measure_with(double (*processor_s)()) {
  state_->processor_s = processor_s;
}

std::uint32_t Simulation::body_count() const {
  return static_cast<std::uint32_t>(state_->world.bodies.size());
}
const TriangleMesh& Simulation::mesh(std::uint32_t body_id) const {
  return state_->world.bodies[body_id]->mesh;
}
const BodySpec& Simulation::body(std::uint32_t body_id) const {
  return state_->world.bodies[body_id]->spec;
}
std::uint32_t Simulation::region_of(std::uint32_t body_id, VertexId v) const {
  return region_at(body(body_id).regions, mesh(body_id).rest_body_m(v));
}
RegionVolumes Simulation::region_volumes(std::uint32_t body_id) const {
  return sectio::region_volumes(body(body_id).regions, mesh(body_id).rest_body_m(), mesh(body_id).triangles());
}
ContactGap Simulation::contact_gap(std::uint32_t body_id) const {
  ContactGap deepest;
  for (EdgeContact& contact : state_->world.contacts_of(body_id))
    if (const ContactGap gap = contact.gap(); gap.depth_m > deepest.depth_m) deepest = gap;
  return deepest;
}
bool Simulation::asleep(std::uint32_t body_id) const {
  return state_->world.bodies[body_id]->asleep();
}
const RigidBody* Simulation::rigid_body(std::uint32_t body_id) const {
  const RigidMotion* rigid = state_->world.bodies[body_id]->rigid();
  return rigid ? &rigid->body : nullptr;
}
std::size_t Simulation::copy_bytes(std::uint32_t body_id) const {
  return state_->world.bodies[body_id]->bytes();
}
PositionsView Simulation::positions_world_m(std::uint32_t body_id) const {
  return state_->world.bodies[body_id]->positions_world_m();
}
std::vector<ScalarField> Simulation::scalars(std::uint32_t body_id) const {
  return state_->world.scalars(body_id);
}
double Simulation::energy_j() const {
  double energy = 0;
  for (const auto& body : state_->world.bodies) energy += body->energy_j();
  return energy;
}
std::vector<BodyOverlap> Simulation::overlaps() const {
  return state_->world.overlaps();
}
const std::optional<JointPose>& Simulation::tool_pose_world(std::uint32_t tool_id) const {
  static const std::optional<JointPose> kNowhere;
  const Tool& tool = state_->world.tools[tool_id];
  return tool.is_withdrawn ? kNowhere : tool.pose;
}

}  // namespace sectio
