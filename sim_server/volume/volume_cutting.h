// Cuts in bodies that are volumes of tetrahedra (paper C, 3.2). Style semi_progressive: what the blade has cut through
// whole is split along its sweep, and parts. Style progressive: edges that the blade crosses are split as it goes, for
// good, and the cut is as deep as its tip; where it is inside elements the tissue parts up to its edge. That front is
// temporary: it is undone exactly and made anew, further on, each time that the blade has gone on a little, and stays
// as it is where the blade stops. A cut is planned on the volume itself and taken back exactly; what it has done to the
// surface becomes the delta.
//
//   front undone; blade's sweep -> cut(volume) -> what changed -> surface's delta; undo, front again     plan()
//   delta accepted -> front undone, redo; model, surface's slots and state follow                        follow()
//   delta by which a part left -> its tetrahedra leave                                                   follow()
//
//   step without an instrument -> a short edge that can go: the surface's delta             tidy(), follow()
//
// Cost of a step with a cut: O(tetrahedra that are cut, those of the front, and their neighbours), whatever the
// volume's size.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "sim_server/deformation/tetra/vertex_set.h"
#include "sim_server/deformation/tetra/volume_deformation.h"
#include "sim_server/surface/cutting/cutting_engine.h"
#include "sim_server/volume/tets/taken_back.h"
#include "sim_server/volume/tets/tet_cut.h"
#include "sim_server/volume/volume_surface.h"

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
                VolumeDeformation& volume, IsFixed is_fixed, bool has_been_cut);

  const StrokeSettings& settings() const override { return settings_; }
  CutPlan plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
               std::span<const BladeMotion> motions) override;
  void follow(const SharedBody& body, const TopologyChange& change) override;
  TopologyDelta tidy(const SharedBody& body) override;
  std::uint64_t edges_collapsed() const override { return edges_collapsed_; }

  const TetTopology& volume() const { return volume_; }
  const VolumeSurface& surface() const { return surface_; }

  // The whole component whose surface has these slots. Its surface is as it was after the last step. O(part).
  VolumePart part(std::span<const VertexId> slots) const;

 private:
  // The sharp edge of a blade.
  struct Edge {
    Vec3 tip_m = Vec3::Zero(), heel_m = Vec3::Zero();
  };
  // Where a blade has been since its cut began, as far back as an element reaches; and the vertices of its cut. Edges
  // are in the shape at rest, by the frames of the tissue around the blade then.
  struct Way {
    std::vector<Edge> edges;
    Edge open_to;                        // how far the tissue is open, or where the way began
    Vec3 forward = Vec3::Zero();         // where it went then, across its edge; zero: nowhere yet
    bool has_front = false;              // what is open there is temporary
    bool ends = false;                   // the tissue does, just ahead
    bool is_through = false;             // it has been cut to its end
    Pose frame_world;                    // of the tissue around it
    double since_cut_m = 0, next_m = 0;  // gone forward from there; the next cut is tried there
    std::vector<VertexId> cut;
    std::vector<VertexId> of_front;  // those of what is temporary
    std::vector<VertexId> near;      // vertices around the blade, where the next cut begins to look
  };
  using Ways = std::map<std::uint32_t, Way>;
  using Kinds = std::map<Corners3, Surface>;  // by corners, ascending
  struct Momentum {
    std::vector<VertexId> of;
    Vec3 sum_n_s = Vec3::Zero();
  };
  // What becomes of the volume if the delta is accepted.
  struct Pending {
    std::vector<TetStep> steps;
    std::size_t final_steps = 0;  // of these
    TetChange change;
    std::vector<TetVertexState> added;
    std::vector<std::pair<VertexId, TetVertexState>> placed;  // older ones
    std::vector<VertexId> moved;                              // numbers that are used again, elsewhere at rest
    Kinds kinds;
    VolumeSurface::Change slots;
    Ways ways;
    Momentum before;
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
  bool move(const SharedBody& body, const MeshDraft& now, const BladeMotion& motion, Stroke& stroke);
  bool follows() const { return !cut_settings_.semi_progressive; }
  double next_cut_m() const;
  double ahead_m(const Way& way) const;
  Edge furthest(const Way& way) const;
  bool has_left(const Way& way) const;
  static bool is_due(const Way& way) { return way.edges.size() > 1 && way.since_cut_m > way.next_m; }
  void settle();
  std::vector<VertexId> settled(const std::vector<VertexId>& vertices) const;
  TetCutOutcome cut_along(const Way& way, double further_m, std::uint32_t exact);
  bool cut_for_good(Way& way, bool is_lifted);
  bool cut_front(Way& way);
  bool cut_all(std::span<const Stroke> strokes, std::span<const std::uint32_t> lifted, Pending& pending);
  double opened_m2() const;
  bool leaves_crumbs() const;
  std::optional<BoundaryChange> open_pinched(const TriangleMesh& mesh, const TakenBack& before, Pending& pending);
  bool plan_change(const SharedBody& body, CutPlan& plan, const TakenBack& before, Pending& pending);
  Surface kind_of_made(const TriangleMesh& mesh, const Corners3& corners) const;
  Momentum momentum(const SharedBody& body, std::vector<VertexId> of) const;
  void keep(const SharedBody& body, const Momentum& before);
  std::vector<std::uint32_t> tetrahedra_of(std::span<const VertexId> slots) const;
  void let_go(std::span<const VertexId> slots);
  void plan_collapse(const SharedBody& body, VertexId v, VertexId onto, TopologyDelta& delta);
  void collapse(const SharedBody& body);

  StrokeSettings settings_;
  TetCutSettings cut_settings_;
  VolumeDeformation& engine_;
  IsFixed is_fixed_;
  TetTopology volume_;
  VolumeSurface surface_;
  double element_m_;  // mean length of the edges
  Ways ways_;
  Kinds kinds_;  // of the surface that the front has divided
  std::optional<Pending> pending_;
  std::optional<Collapsing> collapsing_;
  VertexId tidied_;             // up to there, since the last cut; kNone: all
  bool has_collapsed_ = false;  // an edge, in this round through all
  std::uint64_t edges_collapsed_ = 0;
  mutable VertexSet met_;  // around a blade; scratch
};

}  // namespace sectio
