// Cuts in bodies that are volumes of tetrahedra (paper C, 3.2). Style semi_progressive: elements that the blade has cut
// through whole are split along its sweep, and part. Style progressive: edges that the blade crosses are split as it
// goes, for good, and the cut is as deep as its tip; inside elements the tissue parts up to the blade's edge by a front
// that is temporary (volume_front.h).
//
//   plan(): tracks are extended; in a draft of the topology the front is taken back and sheets are cut; a VolumeCut and
//           the surface's delta are what comes of it; the draft is dropped
//   accept(): the VolumeCut of the plan is applied to topology, model, slots and state; tracks are those of the plan
//
// Cost of a step with a cut: O(tetrahedra that are cut, those of the front, and their neighbours), and the few
// microseconds that a draft of the volume takes (common/core/shared_pages.h).
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "sim_server/surface/cutting/cutting_engine.h"
#include "sim_server/volume/blade_track.h"
#include "sim_server/volume/collapse_edges.h"
#include "sim_server/volume/front_settings.h"
#include "sim_server/volume/volume.h"
#include "sim_server/volume/volume_cut.h"

namespace sectio {

class VolumeCutting final : public CuttingEngine {
 public:
  // `has_been_cut`: the volume came off another one, and may have short edges.
  VolumeCutting(std::shared_ptr<Volume> volume, const FrontSettings& settings, bool has_been_cut);

  CutTraits traits() const override { return {.edge_cuts_anywhere = true, .cuts_inside = true}; }
  CutPlan plan(const SharedBody& body, std::span<const Entry> entries,
               std::span<const BladeMotion> motions) const override;
  void accept(const SharedBody& body, const CutTicket& ticket) override;
  void reject() override { state_.blades.clear(); }
  TidyPlan tidy(const SharedBody& body) const override;
  std::optional<CutPoint> cut_point(const SharedBody& body, std::uint32_t edge_id) const override;
  double uncut_m(const SharedBody& body, const Blade& part, VertexId near) const override;
  bool has_come_apart() const override { return has_come_apart_; }
  // Includes the volume, which the engine shares with other engines.
  void archive(Archive& a, const SharedBody&) override {
    a(*volume_, has_come_apart_, state_.blades, state_.tracks, state_.search);
  }
  // A component has left.
  void follow(const SharedBody& body, const TopologyChange& change) override;

  const TetTopology& volume() const { return volume_->topology; }
  const SurfaceMap& surface() const { return volume_->surface; }
  bool has_front() const { return state_.tracks.front != nullptr; }

 private:
  struct State {
    std::vector<BladeInTissue> blades;
    BladeTracks tracks;
    CollapseSearch search;
  };
  struct Ticket;

  void plan_cut(const Tissue& tissue, std::span<const BladeAtWork> at_work, Ticket& ticket, CutPlan& plan) const;
  void remove_component(const SharedBody& body, std::span<const VertexId> slots);

  std::shared_ptr<Volume> volume_;
  FrontSettings settings_;
  bool has_come_apart_;
  State state_;
};

}  // namespace sectio
