// Cuts in bodies that are volumes of tetrahedra (paper C, 3.2), style semi_progressive: what the blade has cut through
// whole is split along its sweep, and parts. A cut is planned on the volume itself and taken back exactly; what it has
// done to the surface becomes the delta. Part of simulation.*.
//
//   blade's sweep -> cut(volume) -> surface before and after -> delta; undo     plan(), the volume as before
//   delta accepted -> volume, its model, its state exchanged                    follow()
//
// Parts stay in the body; they move by themselves. Cost of a cut: O(n), the model is made anew. Where the tissue turns
// a lot while the blade passes, sheets that follow each other are not one surface, and crumbs are left between them.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "sim_server/cutting/cutting_engine.h"
#include "sim_server/deformation/tetra/volume_engine.h"
#include "sim_server/tet_cutting/tet_cut.h"

namespace sectio {

// The same volume with the vertices named as the first ones, then the others in their order, and for each its number
// before.
struct Renumbered {
  TetMesh mesh;
  std::vector<VertexId> from;
};
Renumbered renumbered(const TetMesh& mesh, std::span<const VertexId> first);

class VolumeCutting final : public CuttingEngine {
 public:
  using MakeModel = std::function<std::unique_ptr<VolumeModel>(const TetMesh&)>;

  // `volume` moves the mesh, whose surface's vertices come first, and outlives the last call.
  VolumeCutting(const TetMesh& mesh, const StrokeSettings& settings, VolumeEngine& volume, MakeModel make_model);

  const StrokeSettings& settings() const override { return settings_; }
  CutPlan plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
               std::span<const BladeMotion> motions) override;
  void follow(const SharedBody& body, const TopologyChange& change) override;

  const TetTopology& volume() const { return volume_; }

 private:
  // The sharp edge of a blade, in the shape at rest.
  struct Edge {
    Vec3 tip_m = Vec3::Zero(), heel_m = Vec3::Zero();
  };
  // Where a blade has been since its cut began, as far back as an element reaches; and the vertices of its cut.
  struct Way {
    std::vector<Edge> edges;
    Edge cut_to;                         // where the last cut was made, or the way began
    double since_cut_m = 0, next_m = 0;  // gone since the last cut; the next one is tried there
    std::vector<VertexId> cut;
  };
  // What becomes of the volume if the delta is accepted.
  struct Pending {
    TetMesh mesh;
    std::uint32_t surface_vertices = 0;
    std::vector<Vec4f> position_world_m, velocity_m_per_s;
    std::map<std::uint32_t, Way> ways;
    std::uint64_t hash = 0;
  };

  TetVertexState state_of(const SharedBody& body, VertexId v) const;
  std::vector<TetVertexState> states_of_all(const SharedBody& body) const;
  Edge at_rest(const SharedBody& body, const Blade& blade, const Pose& frame_world) const;
  Way begin_way(const SharedBody& body, const MeshDraft& now, const Stroke& stroke,
                std::span<const BladeMotion> motions) const;
  void go(const SharedBody& body, Way& way, const BladeMotion& motion);
  void go_through(Way& way);
  TetCutOutcome cut_along(Way& way);
  static bool is_due(const Way& way) { return way.edges.size() > 1 && way.since_cut_m > way.next_m; }
  TetSurface open_pinched(std::vector<VertexId>& made);
  bool plan_change(const SharedBody& body, CutPlan& plan, std::map<std::uint32_t, Way> ways);
  Surface surface_of_made(const TriangleMesh& mesh, const std::array<VertexId, 3>& corners,
                          const std::map<std::array<VertexId, 3>, TriangleId>& before) const;

  StrokeSettings settings_;
  VolumeEngine& engine_;
  MakeModel make_model_;
  TetTopology volume_;  // at rest, where it is cut
  double element_m_;    // mean length of the edges
  std::map<std::uint32_t, Way> ways_;
  std::optional<Pending> pending_;
};

}  // namespace sectio
