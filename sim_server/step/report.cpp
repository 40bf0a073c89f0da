#include <algorithm>
#include <cmath>

#include "sim_server/step/step.h"

namespace sectio {
namespace {

void report_bodies(const SimulatedWorld& world, StepReport& out) {
  out.stability_margin = ModelCheck::kMostMargin;
  out.added_mass_fraction = 0;
  out.bodies_asleep = 0;
  out.drivers.assign(world.bodies.size(), {});
  for (const auto& body : world.bodies) {
    out.bodies_asleep += body->asleep();
    const DeformationEngine& deformation = *body->engines.deformation;
    out.stability_margin = std::min(out.stability_margin, deformation.largest_stable_step_s() / world.scene.step_s);
    const IntegratorDiagnostics d = deformation.diagnostics();
    out.drivers[body->id] = {d.added_mass_fraction, std::isfinite(d.residual) ? d.residual : 0, d.steps_not_met,
                             world.checks[body->id].largest_speed_m_per_s()};
    out.added_mass_fraction = std::max(out.added_mass_fraction, d.added_mass_fraction);
  }
  out.checks.clear();
  out.processor_s.clear();
  for (const ModelCheck& check : world.checks) {
    out.checks.push_back(check.value());
    out.processor_s.push_back(check.processor_s());
  }
}

}  // namespace

void report(SimulatedWorld& world, StepContext& context) {
  for (std::uint32_t b = 0; b < world.bodies.size(); ++b) {
    const BodyStep& step = context.bodies[b];
    world.checks[b].stepped(*world.bodies[b], world.scene.step_s, step.work_j, step.changed || context.gravity_turned,
                            step.processor_s);
  }
  StepReport& out = context.output.report;
  report_bodies(world, out);
  out.local_searches = out.global_searches = 0;
  out.penetration_m = 0;
  out.instrument_work_j = world.contact_work_j;
  for (EdgeContact& contact : world.contacts) {
    out.instrument_work_j += contact.cutting_work_j();
    out.local_searches += contact.local_searches();
    out.global_searches += contact.global_searches();
    out.penetration_m = std::max(out.penetration_m, contact.penetration_m());
  }
}

}  // namespace sectio
