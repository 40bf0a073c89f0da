#include "sim_server/prepare/try_candidates.h"

#include <algorithm>
#include <cmath>

#include "common/core/formatted.h"
#include "sim_server/deformation/integrator_diagnostics.h"
#include "sim_server/world/body.h"

namespace sectio {
namespace {

using planning::Candidate;

constexpr double kMostTried = 2500;  // elements

bool is_fine(const BodySpec& body, const Candidate& c) {
  return body.volume.file.empty() && c.method->needs_volume() && c.elements > kMostTried;
}

}  // namespace

Scene alone(const BodySpec& body, const Scene& scene, const Candidate& c) {
  Scene one;
  one.file = scene.file;
  one.step_place = scene.step_place;
  one.step_s = c.step_s > 0 ? c.step_s : scene.step_s;
  one.gravity_m_per_s2 = scene.gravity_m_per_s2;
  one.bodies.push_back(body);
  BodySpec& spec = one.bodies[0];
  spec.volume.tetrahedra = std::max(12.0, c.tetrahedra);
  spec.model = c.method->model;
  if (c.method->is_implicit) spec.volume.driver = "implicit";
  if (c.method->embeds()) spec.volume.cell_m = c.cell_m;
  return one;
}

planning::Built Trials::of(const OnTrial& subject, const Candidate& c) {
  const bool fine = is_fine(subject.body, c);
  Candidate coarse = c;
  if (fine) coarse.cell_m *= std::cbrt(c.elements / kMostTried);
  if (fine && !c.method->embeds()) coarse.tetrahedra = kMostTried;
  // All fine candidates of a method have one trial, with the cell of the first of them.
  const auto [at, is_new] =
      known_.try_emplace({subject.body.name, c.method, fine ? 0 : c.cell_m, fine ? 0 : coarse.tetrahedra});
  if (is_new) at->second = made(subject, coarse);
  Made trial = at->second;
  if (fine) {
    const double finer = trial.cell_m / c.cell_m, more = c.method->embeds() ? 1 : finer * finer * finer;
    trial.size.vertices *= more;
    trial.surface_vertices *= std::pow(more, 2.0 / 3);
    trial.size.elements *= finer * finer * finer;
    trial.size.part_limit_s /= finer;
    if (trial.weighed) *trial.weighed *= planning::finer(*c.method, trial.cell_m, c.cell_m);
  }
  const double parts_needed = std::clamp(std::ceil(c.step_s / trial.size.part_limit_s), 1.0, 1000.0);
  return {.elements = trial.size.elements,
          .vertices = trial.size.vertices,
          .surface_vertices = trial.surface_vertices,
          .substeps = std::isfinite(trial.size.part_limit_s) ? static_cast<int>(parts_needed) : trial.size.parts,
          .weighed = trial.weighed,
          .unfit = !fine && trial.added_mass > kMostAddedMass
                       ? formatted("%.0f %% of mass added", 100 * trial.added_mass)
                       : ""};
}

Trials::Made Trials::made(const OnTrial& subject, const Candidate& c) {
  const Scene one = filled(subject.body, c);
  Body body(one.bodies[0], one, 0, engines_.model(one.bodies[0].model).make);
  DeformationEngine& engine = *body.engines.deformation;
  Made made{engine.size(body.shared()),
            static_cast<double>(body.mesh.vertex_count()),
            c.cell_m,
            engine.diagnostics().added_mass_fraction,
            {}};
  if (!subject.gravity_body_m_per_s2) return made;
  if (const auto sag = engine.sag(*subject.gravity_body_m_per_s2); !sag.empty())
    made.weighed = weighed(subject).error_of(sag);
  return made;
}

Scene Trials::filled(const BodySpec& body, const Candidate& c) {
  Scene one = alone(body, scene_, c);
  if (!c.method->needs_volume()) return one;
  const Filling filling = c.method->embeds() ? Filling::form : Filling::on_trial;
  const auto [at, is_new] = volumes_.try_emplace({body.name, one.bodies[0].volume.tetrahedra, filling});
  if (is_new) fill_volume(at->second = one.bodies[0], filling);
  one.bodies[0].mesh = at->second.mesh;
  one.bodies[0].tets = at->second.tets;
  return one;
}

const WeighedBody& Trials::weighed(const OnTrial& subject) {
  return weighed_.try_emplace(subject.body.name, subject.body, subject.shape, *subject.gravity_body_m_per_s2)
      .first->second;
}

}  // namespace sectio
