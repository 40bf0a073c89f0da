#include "sim_server/session/verdict.h"

#include <algorithm>
#include <cmath>

#include "common/core/formatted.h"
#include "common/math/intersect.h"
#include "common/mesh/check.h"

namespace sectio {
namespace {

constexpr double kAddedMassTolerated = 0.1 + 1e-9;  // share of the body's own mass
constexpr double kStepsNotMet = 0.01;               // share of all steps
constexpr double kJolt_m_per_s = 0.2;               // a residual may change speeds by so much in a step
constexpr double kThread = 1.5, kThread_m = 0.005;  // longer than a body at rest, and than its crumbs
constexpr double kVolumeChanged = 0.2;              // share of a body's volume at rest

class Reasons {
 public:
  void add_if(bool bad, const std::string& text) {
    if (bad) reasons_.push_back(text);
  }
  void add_count(std::uint64_t count, const std::string& of_what) {
    add_if(count > 0, std::to_string(count) + " " + of_what);
  }
  void add_all(const std::vector<std::string>& texts) { reasons_.insert(reasons_.end(), texts.begin(), texts.end()); }
  std::vector<std::string> take() { return std::move(reasons_); }

 private:
  std::vector<std::string> reasons_;
};

void judge_body(const RunFigures& figures, double step_s, const Simulation& simulation, std::uint32_t id,
                Reasons& reasons) {
  const std::string& name = simulation.body(id).name;
  const auto positions = simulation.positions_world_m(id);
  const auto bad = std::ranges::count_if(positions, [](const Vec3f& x) { return !x.allFinite(); });
  reasons.add_count(static_cast<std::uint64_t>(bad), "vertices of " + name + " are not finite");
  const SurfaceReport surface = check(simulation.mesh(id));
  reasons.add_if(!surface.closed, name + " is not closed");
  reasons.add_if(!surface.manifold, name + " is not manifold");
  std::vector<Vec3> now;
  for (const Vec3f& x : positions) now.push_back(x.cast<double>());
  const double kept = check(simulation.mesh(id), now).volume_m3 / surface.volume_m3;
  reasons.add_if(surface.closed && !(std::abs(kept - 1) < kVolumeChanged),
                 name + " has " + std::to_string(std::lround(100 * kept)) + " % of its volume");
  if (const double thread_m = flung_thread_m(simulation.mesh(id), now); thread_m > 0)
    reasons.add_if(true, formatted("a thread of %s is %.0f mm long: it was flung out", name.c_str(), 1000 * thread_m));
  if (id >= figures.last.drivers.size()) return;
  const std::uint64_t not_met = figures.last.drivers[id].steps_not_met;
  if (static_cast<double>(not_met) > kStepsNotMet * static_cast<double>(figures.steps))
    reasons.add_count(not_met, "steps of " + name + " left a residual above the tolerance");
  const double weights = figures.body_residual[id];
  reasons.add_if(!(weights * kStandardGravity_m_per_s2 * step_s < kJolt_m_per_s),
                 formatted("a step of %s left a residual of %.1f times the weight", name.c_str(), weights));
  const double added = figures.body_added_mass[id];
  reasons.add_if(added > kAddedMassTolerated,
                 std::to_string(std::lround(100 * added)) + " % of mass was added to " + name);
}

}  // namespace

double flung_thread_m(const TriangleMesh& mesh, std::span<const Vec3> positions_m) {
  Box3 at_rest;
  double longest_m = 0;
  for (const Triangle& t : mesh.triangles()) {
    if (!t.alive()) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      at_rest.extend(mesh.rest_body_m(t.v[i]));
      longest_m = std::max(longest_m, (positions_m[t.v[i]] - positions_m[t.v[(i + 1) % 3]]).norm());
    }
  }
  const double flung_m = at_rest.isEmpty() ? 0 : std::max(kThread_m, kThread * at_rest.diagonal().norm());
  return longest_m > flung_m ? longest_m : 0;
}

std::vector<std::string> reasons_against(const RunFigures& figures, const Scene& scene, const Simulation& simulation) {
  Reasons reasons;
  for (std::uint32_t id = 0; id < simulation.body_count(); ++id)
    judge_body(figures, scene.step_s, simulation, id, reasons);
  for (const BodyOverlap& o : figures.overlaps) {
    const std::string &one = simulation.body(o.one).name, &other = simulation.body(o.other).name;
    reasons.add_count(o.come_through,
                      o.one == o.other ? "vertices of skin lie in tissue: a loose part of " + one + " has sunk into it"
                                       : "vertices have come through: " + one + " and " + other + " are in each other");
  }
  reasons.add_if(!std::isfinite(figures.largest_force_n), "a force was not finite");
  reasons.add_count(count_of(figures, EventKind::body_frozen), "times a body froze");
  reasons.add_count(figures.last.forces_capped, "steps in which a reaction was beyond the largest_force_n of its tool");
  const auto is_of_refusals = [](const Expectation& e) { return e.measure->value == &Outcome::refusals; };
  if (std::ranges::none_of(scene.expect, is_of_refusals))
    reasons.add_count(figures.last.cuts_refused, "cuts were refused");
  if (static_cast<double>(figures.steps) >= scene.duration_s / scene.step_s - 0.5)
    reasons.add_all(unmet(scene.expect, figures.outcome));
  return reasons.take();
}

}  // namespace sectio
