// An engine simulates one aspect of one body: collision, deformation, cutting, splitting, or a further process (paper
// A, section 2, figure 1). Engines share the topology (points, edges and faces) and the state of the points. An engine
// keeps all other data that it needs, such as springs or tetrahedra, and brings them up to date when the topology
// changes. Engines that are made together may share data of their own, as those of a volume share its tetrahedra;
// otherwise no engine knows another, and plain values go from one to the other through the simulation.
//
// Each role is an interface in its own room (collision_engine.h and so on); engine/engine_table.h is the table of the
// engines that a body gets.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/delta/topology_delta.h"
#include "common/math/archive.h"
#include "common/math/positions_view.h"
#include "common/mesh/scalar_field.h"
#include "common/mesh/triangle_mesh.h"
#include "sim_server/bodies/particle_state.h"

namespace sectio {

// A body as its engines see it; valid until the body changes.
struct SharedBody {
  std::uint32_t id = 0;
  const TriangleMesh& mesh;
  ParticleState& particles;

  PositionsView positions_world_m() const { return particles.positions(); }
};

// A delta that has been applied, and the slots that matter to data kept beside the mesh: ascending, each once.
struct TopologyChange {
  const TopologyDelta& delta;
  std::span<const VertexId> vertices;     // vertices whose triangles, or the shapes of these at rest, have changed
  std::span<const TriangleId> triangles;  // slots that changed, or that have a corner that did
  std::span<const VertexId> placed;       // vertices that got a place in the world with this change
};

class Engine {
 public:
  virtual ~Engine() = default;

  // Called after a change of topology, such as a cut or a part that left. `body` is the changed body; new slots have
  // their state.
  virtual void follow(const SharedBody& body, const TopologyChange& change) = 0;
  // Appends the scalars that viewers and records get, one value a vertex slot. Called when a state is published, not in
  // each step.
  virtual void publish(const SharedBody&, std::vector<ScalarField>&) const {}
  // Writes or reads all that this engine keeps from step to step (common/math/archive.h). Reading turns the engine of a
  // body that begins into this one, bit for bit; the mesh and the particles have been read before. A session with an
  // engine that can't keeps no checkpoints.
  virtual void archive(Archive& a, const SharedBody&) { a.refuse(); }
};

// A further process in a body: bleeding, heat, healing. It may change the state of the particles.
class ProcessEngine : public Engine {
 public:
  // Called once a step, after deformation, also while the body sleeps.
  virtual void step(const SharedBody& body, double step_s) = 0;
  // Does it move particles? Then the body never sleeps.
  virtual bool moves_particles() const { return true; }
};

}  // namespace sectio
