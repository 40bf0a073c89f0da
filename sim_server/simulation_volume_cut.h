// Cuts in bodies that are volumes of tetrahedra (paper C, 3.2). Style progressive: edges that the blade crosses are
// split as it goes, and the tissue parts as far as the last of them. Style semi_progressive: what the blade has cut
// through whole is split along its sweep, and parts. A cut is planned on the volume itself and taken back exactly; what
// it has done to the surface becomes the delta. Part of simulation.*.
//
//   blade's sweep -> cut(volume) -> what changed -> surface's delta; undo       plan(), the volume as before
//   delta accepted -> redo; model, surface's slots and state follow             follow()
//   delta by which a part left -> its tetrahedra leave                          follow()
//
//   step without an instrument -> a short edge that can go: the surface's delta             tidy(), follow()
//
// Cost of a step with a cut: O(tetrahedra that are cut and their neighbours), whatever the volume's size.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "sim_server/cutting/cutting_engine.h"
#include "sim_server/deformation/tetra/volume_engine.h"
#include "sim_server/simulation_volume_surface.h"
#include "sim_server/tet_cutting/tet_cut.h"

namespace sectio {

// What comes off a volume, with its state and the vertex of each slot of its surface.
struct VolumePart {
  TetMesh mesh;
  std::vector<VertexId> vertex_of;
  std::vector<Vec4f> position_world_m, velocity_m_per_s;
};

class VolumeCutting final : public CuttingEngine {
 public:
  using IsFixed = std::function<bool(const Vec3& rest_body_m)>;  // empty: nothing is

  // `volume` moves the mesh and outlives the last call; `vertex_of` each slot of its surface. What came off another
  // body has been cut.
  VolumeCutting(const TetMesh& mesh, std::vector<VertexId> vertex_of, const TetCutSettings& settings,
                VolumeEngine& volume, IsFixed is_fixed, bool has_been_cut);

  const StrokeSettings& settings() const override { return settings_; }
  CutPlan plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
               std::span<const BladeMotion> motions) override;
  void follow(const SharedBody& body, const TopologyChange& change) override;
  TopologyDelta tidy(const SharedBody& body) override;

  const TetTopology& volume() const { return volume_; }
  const VolumeSurface& surface() const { return surface_; }

  // The whole component whose surface has these slots. Its surface is as it was after the last step. O(part).
  VolumePart part(std::span<const VertexId> slots) const;

 private:
  // The sharp edge of a blade.
  struct Edge {
    Vec3 tip_m = Vec3::Zero(), heel_m = Vec3::Zero();
  };
  // Where a blade has been since its cut began, as far back as an element reaches; and the vertices of its cut.
  struct Way {
    std::vector<Edge> edges;             // in the shape at rest, by the frames of the tissue around the blade then
    Edge cut_to;                         // where the last cut was made, or the way began
    Edge now_world;                      // the last one, where it is
    Pose frame_world;                    // of the tissue around it
    double since_cut_m = 0, next_m = 0;  // gone since the last cut; the next one is tried there
    std::vector<VertexId> cut;
    std::vector<VertexId> near;  // vertices around the blade, where the next cut begins to look
  };
  // What becomes of the volume if the delta is accepted.
  struct Pending {
    std::vector<TetStep> steps;
    TetChange change;
    std::vector<TetVertexState> added;
    VolumeSurface::Change slots;
    std::map<std::uint32_t, Way> ways;
    std::uint64_t hash = 0;
  };
  // What tidy() has planned.
  struct Collapsing {
    VertexId v = kNone, onto = kNone;
    VolumeSurface::Change slots;
    std::uint64_t hash = 0;
  };

  TetVertexState state_of(const SharedBody& body, VertexId v) const;
  VertexId closest_to(const SharedBody& body, const Blade& blade, VertexId from) const;
  Pose frame_around(const SharedBody& body, const Blade& blade, const Pose& frame_world,
                    std::vector<VertexId>& near) const;
  Way begin_way(const SharedBody& body, const MeshDraft& now, const Stroke& stroke,
                std::span<const BladeMotion> motions) const;
  static void add_edge(Way& way, const Blade& blade);
  void go(const SharedBody& body, Way& way, const BladeMotion& motion);
  void go_through(Way& way);
  TetCutOutcome cut_along(Way& way);
  double next_cut_m() const;
  Edge sheet_begins(const Way& way) const;
  static bool is_due(const Way& way) { return way.edges.size() > 1 && way.since_cut_m > way.next_m; }
  bool leaves_crumbs() const;
  std::optional<BoundaryChange> open_pinched(const TriangleMesh& mesh, TetChange& change, std::vector<VertexId>& made);
  bool plan_change(const SharedBody& body, CutPlan& plan, std::map<std::uint32_t, Way> ways);
  Surface kind_of_made(const TriangleMesh& mesh, const Corners3& corners) const;
  std::vector<std::uint32_t> tetrahedra_of(std::span<const VertexId> slots) const;
  void let_go(std::span<const VertexId> slots);
  void plan_collapse(const SharedBody& body, VertexId v, VertexId onto, TopologyDelta& delta);
  void collapse(const SharedBody& body);

  StrokeSettings settings_;
  TetCutSettings cut_settings_;
  VolumeEngine& engine_;
  IsFixed is_fixed_;
  TetTopology volume_;
  VolumeSurface surface_;
  double element_m_;  // mean length of the edges
  std::map<std::uint32_t, Way> ways_;
  std::optional<Pending> pending_;
  std::optional<Collapsing> collapsing_;
  VertexId tidied_;                          // up to there, since the last cut; kNone: all
  bool has_collapsed_ = false;               // an edge, in this round through all
  mutable std::vector<std::uint32_t> seen_;  // by vertex: the round that met it last
  mutable std::uint32_t round_ = 0;
};

}  // namespace sectio
