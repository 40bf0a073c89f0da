#include "tests/support/raw_reactions.h"

#include <algorithm>

namespace sectio::test {
namespace {

class Telling final : public DeformationEngine {
 public:
  Telling(std::unique_ptr<DeformationEngine> engine, std::shared_ptr<RawReactions> to)
      : engine_(std::move(engine)), to_(std::move(to)) {}

  void step(const SharedBody& body, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override {
    engine_->step(body, constraints, reactions);
    *to_ = {};
    to_->constraints = constraints.size();
    for (std::size_t i = 0; i < reactions.size(); ++i) {
      const Vec3& f = reactions[i].force_on_tool_n;
      to_->force_n += f;
      to_->active += reactions[i].active;
    }
    for (std::size_t i = 0; i < reactions.size(); ++i) {
      const Vec3& f = reactions[i].force_on_tool_n;
      const double push_n = f.dot(constraints[i].normal);
      if (push_n > 1e-3 * to_->force_n.norm())
        to_->worst_friction = std::max(to_->worst_friction, (f - push_n * constraints[i].normal).norm() / push_n);
    }
  }
  void follow(const SharedBody& body, const TopologyChange& change) override { engine_->follow(body, change); }
  void publish(const SharedBody& body, std::vector<ScalarField>& out) const override { engine_->publish(body, out); }
  void set_gravity(const Vec3& g) override { engine_->set_gravity(g); }
  Pose rest_frame_world(VertexId v) const override { return engine_->rest_frame_world(v); }
  void release(std::span<const VertexId> piece, const std::optional<SupportPlane>& support) override {
    engine_->release(piece, support);
  }
  bool fixed(VertexId v) const override { return engine_->fixed(v); }
  double mass_kg(VertexId v) const override { return engine_->mass_kg(v); }
  double inverse_mass_per_kg(VertexId v) const override { return engine_->inverse_mass_per_kg(v); }
  void nodes_of(VertexId v, std::vector<NodeShare>& nodes) const override { engine_->nodes_of(v, nodes); }
  std::uint32_t node_count(const ParticleView& particles) const override { return engine_->node_count(particles); }
  NodeMotion node(const ParticleView& particles, std::uint32_t n) const override { return engine_->node(particles, n); }
  void nudge(const SharedBody& body, std::span<const NodeChange> changes) override { engine_->nudge(body, changes); }
  double layer_m() const override { return engine_->layer_m(); }
  double energy_j(const SharedBody& body) const override { return engine_->energy_j(body); }
  double largest_stable_step_s() const override { return engine_->largest_stable_step_s(); }
  VertexId first_bad_vertex() const override { return engine_->first_bad_vertex(); }
  void save(DeformationState& state) const override { engine_->save(state); }
  void restore(const SharedBody& body, const DeformationState* state) override { engine_->restore(body, state); }
  void use_stable_driver(int steps) override { engine_->use_stable_driver(steps); }
  IntegratorDiagnostics diagnostics() const override { return engine_->diagnostics(); }
  bool deforms() const override { return engine_->deforms(); }
  bool asleep() const override { return engine_->asleep(); }
  void wake() override { engine_->wake(); }
  RigidMotion* rigid() override { return engine_->rigid(); }

 private:
  std::unique_ptr<DeformationEngine> engine_;
  std::shared_ptr<RawReactions> to_;
};

}  // namespace

EngineTable engines_that_tell(std::shared_ptr<RawReactions> to) {
  EngineTable table = standard_engines();
  for (ModelEntry& model : table.models)
    model.make = [make = model.make, to](const EngineSite& site) {
      BodyEngines engines = make(site);
      if (site.body.id == 0) engines.deformation = std::make_unique<Telling>(std::move(engines.deformation), to);
      return engines;
    };
  return table;
}

}  // namespace sectio::test
