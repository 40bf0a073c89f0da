// An engine simulates one aspect of one body: collision, deformation, cutting, splitting, or whatever else goes on in
// it (paper A, section 2, figure 1). Engines share the topology, points, edges and faces, and the state of the points.
// What an engine needs besides, springs or particles or tetrahedra, it keeps itself and brings up to date when the
// topology changes. None knows another: what they say to each other goes through the simulation as plain values.
//
// Each role is an interface in its own room (collision_engine.h and so on); which engines a body gets is said in one
// table, engine/engine_table.h.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/delta/topology_delta.h"
#include "common/mesh/scalar_field.h"
#include "common/mesh/triangle_mesh.h"
#include "sim_server/bodies/particle_state.h"

namespace sectio {

// A body as its engines see it; good until the body changes.
struct SharedBody {
  std::uint32_t id = 0;
  const TriangleMesh& mesh;
  ParticleState& particles;
  CompactPositions& compact;

  std::span<const Vec3f> positions_world_m() const { return compact.of(particles); }
};

// A delta that has been applied, and what it means to somebody who keeps data beside the mesh. Ascending, each once.
struct TopologyChange {
  const TopologyDelta& delta;
  std::span<const VertexId> vertices;     // whose triangles, or these triangles' shapes at rest, are not what they were
  std::span<const TriangleId> triangles;  // slots that changed, or that have a corner that did
  std::span<const VertexId> placed;       // were given a place in the world with this change
};

class Engine {
 public:
  virtual ~Engine() = default;

  // After a change of topology: a cut, a part that left. The body is as it is now; new slots have their state.
  virtual void follow(const SharedBody& body, const TopologyChange& change) = 0;
  // Appends the scalars that viewers and records get, one value a vertex slot. Called when a state is published, not in
  // each step.
  virtual void publish(const SharedBody&, std::vector<ScalarField>&) const {}
};

// What else goes on in a body while it is simulated: bleeding, heat, healing. It may change the state of the particles.
class ProcessEngine : public Engine {
 public:
  // Once a step, after deformation, while the body sleeps, too.
  virtual void step(const SharedBody& body, double step_s) = 0;
  // Whether it moves particles: then the body never sleeps.
  virtual bool moves_particles() const { return true; }
};

}  // namespace sectio
