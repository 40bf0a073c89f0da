// Cuts a volume with blades: along their tracks for good, and at their fronts for the time being.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim_server/volume/blade_track.h"
#include "sim_server/volume/tets/tet_cut.h"

namespace sectio {

// One edge at work.
struct BladeAtWork {
  std::uint32_t edge_id = 0;
  bool is_lifted = false;  // its cut ends with this step
};

class BladeCut {
 public:
  // Cuts `topology`, which has no front and no operations; the tracks are those of the plan.
  BladeCut(const Tissue& tissue, TetTopology& topology, BladeTracks& tracks)
      : tissue_(tissue), settings_(tissue.settings), topology_(topology), tracks_(tracks) {}

  // False when nothing opens that was closed. Lasting cuts come first: they stay when the front is undone.
  bool run(std::span<const BladeAtWork> at_work);

  std::size_t lasting_operations() const { return lasting_operations_; }
  const std::vector<std::uint32_t>& tried() const { return tried_; }  // edges for which a cut was due

 private:
  TetCutOutcome cut_along(const BladeTrack& track, double further_m, std::uint32_t exact_sides);
  // `behind_m`: the sheet begins this far behind the way of the track.
  TetCutOutcome cut_sheet(const BladeTrack& track, std::vector<BladeEdge> way, double behind_m, double further_m,
                          std::uint32_t exact_sides);
  bool cut_for_good(BladeTrack& track, bool is_lifted);
  bool cut_front(BladeTrack& track);
  // Tissue between the sides of a slit that the blade has left or gone through.
  void open_to_blade(Slit& slit, const BladeTrack& track) const;
  void open_bridges_of(const Slit& slit, const BladeTrack& track);

  const Tissue& tissue_;
  const FrontSettings& settings_;
  TetTopology& topology_;
  BladeTracks& tracks_;
  bool has_opened_bridges_ = false;
  std::size_t lasting_operations_ = 0;
  std::vector<std::uint32_t> tried_;
};

}  // namespace sectio
