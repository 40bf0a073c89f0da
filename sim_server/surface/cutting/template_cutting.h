// The cutting engine of bodies that are surfaces and are cut with templates. It owns the record of the cuts.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "sim_server/surface/cutting/cutting_engine.h"
#include "sim_server/surface/cutting/plan_template_cut.h"

namespace sectio {

class TemplateCutting final : public CuttingEngine {
 public:
  explicit TemplateCutting(const TemplateSettings& settings) : settings_(settings) {}

  CutTraits traits() const override { return {true, false, settings_.join_tolerance_m, settings_.min_step_m}; }
  CutPlan plan(const SharedBody& body, std::span<const Entry> entries,
               std::span<const BladeMotion> motions) const override;
  void accept(const SharedBody& body, const CutTicket& ticket) override;
  void reject() override;
  // Strokes end with the tissue that they were in.
  void follow(const SharedBody& body, const TopologyChange& change) override;

  std::optional<CutPoint> cut_point(const SharedBody& body, std::uint32_t edge_id) const override;
  void archive(Archive& a, const SharedBody&) override { a(cuts_); }

 private:
  struct Ticket;

  TemplateSettings settings_;
  std::shared_ptr<const TemplateCuts> cuts_ = std::make_shared<const TemplateCuts>();
};

}  // namespace sectio
