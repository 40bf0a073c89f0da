// A scene that is stepped: the facade of the simulation. The same input gives the same output, bit for bit.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/material/region_volumes.h"
#include "common/math/positions_view.h"
#include "common/mesh/scalar_field.h"
#include "sim_server/scene/scene.h"
#include "sim_server/world/step_io.h"

namespace sectio {

class RigidBody;
struct EngineTable;

class Simulation {
 public:
  // The scene is ready (sim_server/prepare): its models are chosen and its volumes filled. Throws InputError when it
  // can't be simulated, e.g. with a step beyond the stable one.
  explicit Simulation(const Scene& scene);
  // With engines of one's own (engine/engine_table.h).
  Simulation(const Scene& scene, const EngineTable& engines);
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  // Runs the stages of step/step.h in order. The result is valid until the next call.
  const StepOutput& step(const StepInput& input);

  // The state between two steps as bytes, from which a simulation of the same scene, before its first step, goes on bit
  // for bit. Nothing: an engine can't say its state.
  std::optional<std::vector<std::uint8_t>> save() const;
  // Throws InputError when the bytes are not a state of this scene; the simulation is then of no use any more.
  void load(std::span<const std::uint8_t> state);

  // Sets a clock of the processor's time, s, which only BodyCheck::cpu uses. Without it, that time is not measured.
  void measure_with(double (*processor_s)());

  // Bodies of the scene, then parts that came off, in order.
  std::uint32_t body_count() const;
  const BodySpec& body(std::uint32_t body_id) const;  // a part: its name, colours and material, without mesh
  // The region at the rest position of a surface vertex: an index into body().regions, or kNoRegion.
  std::uint32_t region_of(std::uint32_t body_id, VertexId v) const;
  // The volume of each region in a body, at rest. O(volume), for reports.
  RegionVolumes region_volumes(std::uint32_t body_id) const;
  // The gap of the instrument that presses deepest, after a step.
  ContactGap contact_gap(std::uint32_t body_id) const;
  // The body rests, and is not stepped until something touches it.
  bool asleep(std::uint32_t body_id) const;
  // Null when the body deforms.
  const RigidBody* rigid_body(std::uint32_t body_id) const;
  const TriangleMesh& mesh(std::uint32_t body_id) const;
  // Memory of a body's topology and state, without the engines' own data.
  std::size_t copy_bytes(std::uint32_t body_id) const;
  // One entry a vertex slot of the mesh; entries of dead slots are stale but finite.
  PositionsView positions_world_m(std::uint32_t body_id) const;
  // The scalar fields that the engines of a body publish now: at most kMaxScalars, with one value a vertex slot each.
  std::vector<ScalarField> scalars(std::uint32_t body_id) const;
  // Kinetic, elastic and gravitational, of all bodies; heights count from the origin. O(all), for tests and reports.
  double energy_j() const;
  // Pairs of bodies that lie in each other now, but for organs that the scene placed so. O(all), for reports.
  std::vector<BodyOverlap> overlaps() const;
  // The pose of each tool in the newest sample used; nothing before the first sample, and since a withdrawal.
  const std::optional<JointPose>& tool_pose_world(std::uint32_t tool_id) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sectio
