// The interface of a cutting engine: it plans a step's cuts in one body.
#pragma once

#include <span>

#include "sim_server/engine/engine.h"
#include "sim_server/surface/cutting/plan_cut.h"

namespace sectio {

class CuttingEngine : public Engine {
 public:
  virtual const StrokeSettings& settings() const = 0;

  // See plan_cut(). The mesh changes only when the simulation accepts the plan. An engine that cuts data of its own
  // changes these data in follow(), when the delta that it planned has been applied.
  virtual CutPlan plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
                       std::span<const BladeMotion> motions) = 0;

  // A small piece of work that can wait for a step in which no instrument is at the body. As with a plan, the mesh
  // changes only when the simulation applies the delta, which is mostly empty.
  virtual TopologyDelta tidy(const SharedBody&) { return {}; }
  virtual std::uint64_t edges_collapsed() const { return 0; }  // by tidy(), so far
};

// Cuts surfaces in the style that the settings name.
class SurfaceCutting final : public CuttingEngine {
 public:
  SurfaceCutting(const StrokeSettings& settings, bool loops_free_islands)
      : settings_(settings), loops_free_islands_(loops_free_islands) {}

  const StrokeSettings& settings() const override { return settings_; }
  CutPlan plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
               std::span<const BladeMotion> motions) override {
    return plan_cut(body.mesh, body.particles.view(), cuts, entries, motions, settings_, loops_free_islands_);
  }
  void follow(const SharedBody&, const TopologyChange&) override {}  // all data is in BodyCuts

 private:
  StrokeSettings settings_;
  bool loops_free_islands_;
};

}  // namespace sectio
