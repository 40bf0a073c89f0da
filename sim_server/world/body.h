// One body of a simulation: its topology and state, and the engines that share these, kept in step with each other.
//
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sim_server/bodies/particle_state.h"
#include "sim_server/bodies/stillness.h"
#include "sim_server/body_contact/contact_solver.h"
#include "sim_server/body_contact/find_lips.h"
#include "sim_server/body_contact/rigid_motion.h"
#include "sim_server/engine/engine_table.h"
#include "sim_server/scene/scene.h"
#include "sim_server/surface/indentation/contact_templates.h"
#include "sim_server/world/change.h"
#include "sim_server/world/recovery.h"
#include "sim_server/world/step_io.h"
#include "sim_server/world/swept_tissue.h"

namespace sectio {

class Body {
 public:
  // Throws InputError when step_s is beyond the stable step.
  Body(const BodySpec& spec, const Scene& scene, std::uint32_t id, MakeEngines make);

  // A part that came off another body: `spec` as for that one, without its mesh; must outlive the body. The particles
  // as they were, `frame` where its shape at rest is, `vertex_from` its vertices' slots in the parent, if it has one.
  // It moves as a whole when the specification says so and its shape has a rigid motion; else it goes on deforming.
  Body(const BodySpec& spec, const Scene& scene, std::uint32_t id, MakeEngines make, TriangleMesh mesh,
       ParticleState particles, const Pose& frame, const Body* parent = nullptr,
       std::span<const VertexId> vertex_from = {});

  // A part that archive() is about to read: until then it is one tetrahedron.
  struct Unread {
    Pose frame_at_first_world;
    bool is_rigid = false;
  };
  Body(const BodySpec& spec, const Scene& scene, std::uint32_t id, MakeEngines make, const Unread& unread);
  // Writes or reads all that the body keeps from step to step (common/math/archive.h).
  void archive(Archive& a);
  const Pose& frame_at_first_world() const { return frame_at_first_world_; }  // its shape at rest

  const MakeEngines& make_engines() const { return make_; }  // makes the engines of this body and of its parts
  std::size_t bytes() const { return mesh.bytes() + particles.bytes(); }
  SharedBody shared() { return {id, mesh, particles}; }
  SurfaceView view() { return {mesh, particles.positions(), id}; }
  PositionsView positions_world_m() const { return particles.positions(); }
  ParticleView particle_view() const { return particles.view(); }
  ContactBody contact_body();
  // A point of the surface and its velocity: the weighted mean of these vertices; kNone counts for nothing.
  Vec3 position_at(const std::array<VertexId, 3>& v, const Vec3& weights) const;
  Vec3 velocity_at(const std::array<VertexId, 3>& v, const Vec3& weights, const Vec3& point_world_m) const;
  // The box of the current positions; leaves the collision engine as it is.
  Box3 bounds_world_m();
  double thinnest_m() const { return thinnest_m_; }                      // least side of its box at rest, when it began
  double energy_j() { return engines.deformation->energy_j(shared()); }  // see DeformationEngine
  // The collision engine, with the current positions.
  const CollisionEngine& tree();

  // The frame at rest of the connected piece that a vertex belongs to.
  Pose frame_world(VertexId v) const { return engines.deformation->rest_frame_world(v); }
  // A point of the undeformed surface in the world; and the normal there, smooth over edges, which turns with tissue
  // that sags or falls, but not with a dent.
  Vec3 undeformed_world_m(const std::array<VertexId, 3>& v, const Vec3& bary) const;
  Vec3 undeformed_normal_world(const MeshDraft& surface, const std::array<VertexId, 3>& v, const Vec3& bary) const;
  // The direction of a blade in the tissue at rest. The frame at rest does not turn with the dent that the blade makes.
  void express_in_rest_frame(std::span<const Entry> entries, BladeMotion& motion);
  // The tissue swept by blades; made when it is first asked for, before the first cut.
  SweptTissue& swept_tissue();
  // The largest depth that the tissue's thickness allows a groove from a point of the surface to the tip.
  double depth_limit_m(const Vec3& surface_world_m, const Vec3& tip_world_m);

  // Applies a change and brings the state, the engines and the lips up to date; of a cut also the strokes. Nothing when
  // the change does not fit the mesh: it is as before, and strokes have ended where they are. Called by commit() alone.
  std::optional<AppliedChange> apply(const Change& change);

  bool deforms() const { return engines.deformation->deforms(); }
  // The motion of a body that doesn't deform, else null.
  RigidMotion* rigid() const { return engines.deformation->rigid(); }
  // Brings what is derived from the particles up to date after something else has moved them.
  void particles_moved();

  // Deforms the body, steps its processes, and separates its lips; a body that sleeps only steps its processes.
  void deform(std::span<const PointConstraint> constraints, std::span<Reaction> reactions, double step_s);
  // The body rests, and is not moved until it is woken.
  bool asleep() const { return asleep_ || engines.deformation->asleep(); }
  bool is_calm() const { return stillness_.is_calm(); }  // it has hardly moved for a while
  bool stands_still() const { return frozen || spared || asleep(); }
  void wake();
  // Called after deform() when nothing touches the body, which falls asleep when it has come to rest.
  void watch_rest(const Scene& scene);
  // Called after deform(): another driver took over or gave back, or stability has taken much added mass.
  using Happenings = std::vector<std::pair<EventKind, std::string>>;
  Happenings watch_driver();
  // Called after all that moves the body, with whether something touched it: nothing that isn't finite or is beyond
  // the bounds of recovery.h is left, and the events say what became of the body.
  Happenings guard(bool touched, double step_s);
  // Called after deform(); contacts change the velocities of nodes and move them.
  void nudge(std::span<const NodeChange> changes);
  // Makes all of the body that isn't held faster by the same.
  void push_as_one(const Vec3& impulse_n_s);

  const BodySpec& spec;
  const std::uint32_t id;
  TriangleMesh mesh;
  ParticleState particles;
  BodyEngines engines;
  CutTraits cut_traits;
  // Contact with temporary elements (world/indentation.h); otherwise instruments move the vertices.
  bool contact_by_templates() const { return spec.contact.style == "templates"; }
  TemporaryContact contact;
  std::vector<double> still_s;               // by owner: for how long what it let go has not moved
  std::vector<TriangleId> unsettled;         // triangles of cuts whose parts are not decided yet
  std::vector<VertexImpulse> resting_loads;  // a sleeping piece gives these to the bodies below it in each step
  std::uint32_t parts_made = 0;  // parts that came off: the n-th one of `liver` is `liver.n`, whatever else there is
  bool frozen = false;           // it stays as it was (recovery.h), and can't be cut
  bool spared = false;           // its time stands still in this step: the session is behind its clock

 private:
  void begin(EngineSite site);
  void separate_lips(double step_s);
  using Seeds = std::span<const std::pair<VertexId, VertexState>>;
  void place(Seeds seeds);
  void bring_dead_to_rest(const TopologyDelta& delta);
  void free_islands(std::span<const Island> islands);

  LipFinder lips_;
  std::unique_ptr<SweptTissue> swept_;
  MakeEngines make_;  // for parts, too
  Pose frame_at_first_world_;
  bool tree_stale_ = false;
  double thinnest_m_ = 0;
  std::optional<Box3> bounds_world_m_;  // while the tree is stale; nothing: nobody has asked
  bool asleep_ = false;
  bool much_added_ = false;           // much mass has been added for stability
  bool implicit_ = false;             // the last step was taken over by a driver that is always stable
  std::uint64_t implicit_steps_ = 0;  // so far, as the deformation engine says
  Stillness stillness_;
  Recovery recovery_;
};

}  // namespace sectio
