// The cutting engine of bodies that are surfaces and are cut progressively. It owns the record of the cuts.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "sim_server/surface/cutting/cutting_engine.h"
#include "sim_server/surface/cutting/plan_cut.h"
#include "sim_server/surface/cutting/tidy_lips.h"

namespace sectio {

class SurfaceCutting final : public CuttingEngine {
 public:
  SurfaceCutting(const StrokeSettings& settings, bool loops_free_islands)
      : settings_(settings), loops_free_islands_(loops_free_islands) {}

  CutTraits traits() const override { return {false, false, settings_.join_tolerance_m, settings_.min_step_m}; }
  CutPlan plan(const SharedBody& body, std::span<const Entry> entries,
               std::span<const BladeMotion> motions) const override;
  void accept(const SharedBody& body, const CutTicket& ticket) override;
  void reject() override;
  // Strokes end with the tissue that they were in.
  void follow(const SharedBody& body, const TopologyChange& change) override;

  std::optional<CutPoint> cut_point(const SharedBody& body, std::uint32_t edge_id) const override;
  std::optional<InOpenCut> in_open_cut(const SharedBody& body, const Blade& blade) const override {
    return sectio::in_open_cut(body.mesh, body.particles.view(), *cuts_, blade);
  }
  bool is_temporary(std::span<const TriangleId> triangles) const override;
  TidyPlan tidy(const SharedBody& body) const override;
  void archive(Archive& a, const SharedBody&) override { a(cuts_, search_); }

 private:
  struct Ticket;
  void stand_at_rim(const MeshDraft& now, const Grooves& grooves, Stroke& stroke) const;

  StrokeSettings settings_;
  bool loops_free_islands_;
  std::shared_ptr<const SurfaceCuts> cuts_ = std::make_shared<const SurfaceCuts>();
  LipSearch search_;
};

}  // namespace sectio
