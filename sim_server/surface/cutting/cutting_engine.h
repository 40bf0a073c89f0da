// What a cutting engine is to the simulation: it plans a step's cuts in one body.
#pragma once

#include <span>

#include "sim_server/engine/engine.h"
#include "sim_server/surface/cutting/plan_cut.h"

namespace sectio {

class CuttingEngine : public Engine {
 public:
  virtual const StrokeSettings& settings() const = 0;

  // See plan_cut(). The mesh changes only when the simulation accepts the plan. An engine that has data of its own to
  // cut changes them when it has to follow() the delta that it planned.
  virtual CutPlan plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
                       std::span<const BladeMotion> motions) = 0;

  // Instead, in a step in which no instrument is at the body: a little of what can wait. The mesh changes only when the
  // simulation applies the delta, as with a plan; most are empty.
  virtual TopologyDelta tidy(const SharedBody&) { return {}; }
  virtual std::uint64_t edges_collapsed() const { return 0; }  // by that, so far
};

// Cuts surfaces, in the style that the settings say.
class SurfaceCutting final : public CuttingEngine {
 public:
  SurfaceCutting(const StrokeSettings& settings, bool loops_free_islands)
      : settings_(settings), loops_free_islands_(loops_free_islands) {}

  const StrokeSettings& settings() const override { return settings_; }
  CutPlan plan(const SharedBody& body, const BodyCuts& cuts, std::span<const Entry> entries,
               std::span<const BladeMotion> motions) override {
    return plan_cut(body.mesh, body.particles.view(), cuts, entries, motions, settings_, loops_free_islands_);
  }
  void follow(const SharedBody&, const TopologyChange&) override {}  // BodyCuts hold all there is

 private:
  StrokeSettings settings_;
  bool loops_free_islands_;
};

}  // namespace sectio
