// The interface of a cutting engine: it plans a step's cuts in one body.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "sim_server/engine/engine.h"
#include "sim_server/surface/cutting/plan_cut.h"

namespace sectio {

// See CuttingEngine::tidy().
struct TidyPlan {
  TopologyDelta delta;                      // empty(): the topology stays
  std::uint32_t edges_collapsed = 0;        // by this
  std::shared_ptr<const CutTicket> ticket;  // nullptr: there is nothing to do
};

// How an edge cuts with an engine, for the contact of the edge with the body.
struct CutTraits {
  bool edge_cuts_anywhere = false;  // every part of the edge in the body cuts; else the cut follows the tip
  bool cuts_inside = false;         // whatever the edge meets in the body, the surface being ahead of it or not
  double join_tolerance_m = 2e-3;   // the end of a cut this close to a blade is that blade's
  double min_step_m = 1e-4;         // the instrument moves this far before a cut opens
};

class CuttingEngine : public Engine {
 public:
  virtual CutTraits traits() const = 0;

  // See plan_cut(). Changes nothing: the engine goes on with the plan when it has to accept() its ticket.
  virtual CutPlan plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
                       std::span<const BladeMotion> motions) const = 0;

  // The place where the line of a blade enters an open cut of the body. Such a blade is in the tissue, though it
  // touches none.
  virtual std::optional<InOpenCut> in_open_cut(const SharedBody&, const BodyCuts&, const Blade&) const { return {}; }

  // Plans a small piece of work that can wait for a step in which no instrument is at the body. Like
  // plan() it changes nothing.
  virtual TidyPlan tidy(const SharedBody&) const { return {}; }

  // A plan has been accepted: its delta, unless that is empty, has been applied. Instead of follow(), which is for
  // changes that this engine has not planned.
  virtual void accept(const SharedBody&, const CutTicket&) {}
};

// Cuts surfaces in the style that the settings name.
class SurfaceCutting final : public CuttingEngine {
 public:
  SurfaceCutting(const StrokeSettings& settings, bool loops_free_islands)
      : settings_(settings), loops_free_islands_(loops_free_islands) {}

  CutTraits traits() const override {
    return {settings_.style == CutStyle::templates, false, settings_.join_tolerance_m, settings_.min_step_m};
  }
  CutPlan plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
               std::span<const BladeMotion> motions) const override {
    return plan_cut(body.mesh, body.particles.view(), cuts, entries, motions, settings_, loops_free_islands_);
  }
  std::optional<InOpenCut> in_open_cut(const SharedBody& body, const BodyCuts& cuts,
                                       const Blade& blade) const override {
    return sectio::in_open_cut(body.mesh, body.particles.view(), cuts, blade);
  }
  void follow(const SharedBody&, const TopologyChange&) override {}  // all data is in BodyCuts

 private:
  StrokeSettings settings_;
  bool loops_free_islands_;
};

}  // namespace sectio
