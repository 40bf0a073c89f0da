// A cut of a volume as a value: what it does to the tetrahedra, to the surface and to the state.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sim_server/volume/blade_cut.h"
#include "sim_server/volume/blade_track.h"
#include "sim_server/volume/tets/boundary_change.h"
#include "sim_server/volume/tets/front_rollback.h"

namespace sectio {

struct VolumeCut {
  // The topology: this front goes (nullptr: there is none), the lasting cuts are made, the tracks' new front is opened.
  std::shared_ptr<const VolumeFront> undone;
  TetDelta lasting;
  // The same change, for data kept beside the volume (model, particles).
  TetChange change;
  std::vector<TetVertexState> added;                        // states of its added vertices
  std::vector<std::pair<VertexId, TetVertexState>> placed;  // older vertices that are elsewhere now
  SurfaceMap::Change slots;
  Volume::Momentum before;  // to be conserved
};

// Call once the body has the delta of the surface. `front`: the new one; nullptr: there is none.
void apply_cut(Volume& volume, const SharedBody& body, const VolumeCut& cut, const VolumeFront* front);

// Plans what blades cut in one step.
class VolumeCutPlanner {
 public:
  // `tracks` include the front that is open.
  VolumeCutPlanner(const Tissue& tissue, const BladeTracks& tracks)
      : volume_(tissue.volume),
        tissue_(tissue),
        tracks_(tracks),
        draft_(tissue.volume.topology),
        front_labels_(tracks.front ? &tracks.front->labels : nullptr) {}

  // Nothing when nothing opens, or when the surface would be no manifold. `surface`: what the cut makes of the surface.
  std::optional<VolumeCut> plan(std::span<const BladeAtWork> at_work, MeshDraft& surface);

  const BladeTracks& tracks() const { return tracks_; }               // after the cut
  const std::vector<std::uint32_t>& tried() const { return tried_; }  // edges for which a cut was due
  // The front can't go on as it is: what it has opened would close again.
  bool would_close() const { return would_close_; }

 private:
  bool open_pinched_edges(const FrontRollback& rollback, TetChange& change, BoundaryChange& boundary);
  bool plan_surface(const BoundaryChange& boundary, std::span<const VertexId> renumbered, VolumeCut& cut,
                    MeshDraft& surface) const;
  void collect_states(FrontRollback& rollback, VolumeCut& cut, std::vector<VertexId>& renumbered);
  SurfaceLabels labels_beneath_front(const BoundaryChange& of_front) const;
  Surface label_of(const Corners3& corners) const;

  const Volume& volume_;
  const Tissue& tissue_;
  BladeTracks tracks_;
  TetTopology draft_;
  const SurfaceLabels* front_labels_;  // labels of the undone front; nullptr: there is none
  std::size_t lasting_operations_ = 0;
  std::vector<std::uint32_t> tried_;
  bool would_close_ = false;
};

}  // namespace sectio
