#include "sim_server/prepare/choose_model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <tuple>

#include "common/core/error.h"
#include "common/core/log.h"
#include "sim_server/deformation/surface_springs.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/planning/plan.h"
#include "sim_server/prepare/fill_volumes.h"
#include "sim_server/prepare/machine_speed.h"
#include "sim_server/surface/surface_engines.h"
#include "sim_server/world/body.h"

namespace sectio {
namespace {

using planning::Candidate;
using planning::Method;

constexpr std::size_t kMoments = 150;  // of a trace that are looked at
constexpr double kOnFloor_m = 1e-3;
constexpr double kFreeSteps_s[] = {1e-3, 5e-4, 2.5e-4};
constexpr const char* kNoStep = ": step_s: no step is short enough for the bodies with surface springs";

bool is_auto(const BodySpec& body) {
  return body.model == "auto";
}

planning::ToolUse use_of(const ToolSpec& tool, const Pose& body) {
  const InstrumentKind& kind = instrument_of(tool.kind);
  planning::ToolUse use;
  use.name = tool.name;
  use.ball_radius_m = tool.geometry.sphere_radius_m;
  if (kind.grip_force_n > 0) use.grip_radius_m = tool.grip_radius_m.value_or(kind.grip_radius_m);
  const InstrumentShape rest = kind.shape(tool.geometry, {tool.intensity, 0, 0});
  use.cuts = (rest.edge_tip_tool_m - rest.edge_heel_tool_m).norm() > 0;
  if (tool.trace.empty()) return use;
  const double begin = tool.trace.front().time_s, end = tool.trace.back().time_s;
  for (std::size_t i = 0; i < kMoments; ++i) {
    const TracePoint at = point_at(tool.trace, begin + (end - begin) * static_cast<double>(i) / (kMoments - 1));
    const InstrumentShape shape = kind.shape(tool.geometry, {tool.intensity, at.opening_rad, 0});
    const auto local = [&](const Vec3& p) { return body.to_local(at.pose_world.to_world(p)); };
    use.moments.push_back({local(use.cuts ? shape.edge_tip_tool_m : shape.a_tool_m), local(shape.b_tool_m),
                           body.orientation.conjugate() * at.pose_world.orientation,
                           at.opening_rad < kind.grip_below_rad});
  }
  return use;
}

planning::BodySituation situation_of(const BodySpec& body, const Scene& scene) {
  planning::BodySituation s;
  s.material = body.material;
  s.bed_radius_m = body.material.foundation_radius_m;
  Vec3 gravity = scene.gravity_m_per_s2;
  for (const GravityChange& change : scene.gravity_changes)
    if (change.gravity_m_per_s2.norm() > gravity.norm()) gravity = change.gravity_m_per_s2;
  s.most_gravity_m_per_s2 = gravity.norm();
  if (gravity.norm() > 0) s.down_body = body.pose.orientation.conjugate() * gravity.normalized();
  double lowest_m = HUGE_VAL;
  for (const Vec3& p : body.mesh.vertices_body_m) {
    const Vec3 x = body.pose.to_world(p);
    lowest_m = std::min(lowest_m, x.z());
    if (body.fixed && body.fixed->contains(x)) s.fixed_m.push_back(p);
  }
  s.lies_on_floor = scene.floor_z_m && lowest_m < *scene.floor_z_m + kOnFloor_m;
  for (const ToolSpec& tool : scene.tools) s.tools.push_back(use_of(tool, body.pose));
  return s;
}

// The body alone in its scene, with the model of a candidate.
Scene alone(const BodySpec& body, const Scene& scene, const Candidate& c) {
  Scene one;
  one.file = scene.file;
  one.step_s = c.step_s > 0 ? c.step_s : scene.step_s;
  one.gravity_m_per_s2 = scene.gravity_m_per_s2;
  one.bodies.push_back(body);
  BodySpec& spec = one.bodies[0];
  spec.volume.tetrahedra = std::max(12.0, c.tetrahedra);
  const planning::MethodTraits& method = traits_of(c.method);
  spec.model = method.model;
  if (method.is_implicit) spec.volume.driver = "implicit";
  if (method.embeds) spec.volume.cell_m = c.cell_m;
  return one;
}

// The counts and the stable step of a candidate that was built. A fine one is built with fewer tetrahedra, and counted
// up by powers of their number.
struct Trial {
  ModelSize size;
  double surface_vertices = 0;

  planning::Built in_steps_of(double step_s) const {
    const double parts_needed = std::clamp(std::ceil(step_s / size.part_limit_s), 1.0, 1000.0);
    return {size.elements, size.vertices, surface_vertices,
            std::isfinite(size.part_limit_s) ? static_cast<int>(parts_needed) : size.parts};
  }
};

// `one`: the body alone, filled.
Trial built(const Scene& one) {
  Body made(one.bodies[0], one, 0, standard_engines().model(one.bodies[0].model).make);
  return {made.engines.deformation->size(made.shared()), static_cast<double>(made.mesh.vertex_count())};
}

class Trials {
 public:
  Trial of(const BodySpec& body, const Scene& scene, const Candidate& c) {
    const bool is_fine = c.tetrahedra > kMostTried && body.volume.file.empty();
    Candidate coarse = c;
    if (is_fine) coarse.tetrahedra = kMostTried;
    if (is_fine)
      coarse.cell_m *= std::cbrt(std::max(1.0, (traits_of(c.method).embeds ? c.elements : c.tetrahedra) / kMostTried));
    // Many elements: all such candidates of a method have one trial, with the cell of the first of them.
    const bool is_one_of_many = is_fine && (!traits_of(c.method).embeds || c.elements > kMostTried);
    const auto [at, is_new] =
        known_.try_emplace({body.name, c.method, is_one_of_many ? 0 : c.cell_m, coarse.tetrahedra});
    auto& [trial, cell_m] = at->second;
    if (is_new) trial = built(filled(body, scene, coarse)), cell_m = coarse.cell_m;
    return is_fine ? counted_up(trial, c, cell_m / c.cell_m) : trial;
  }

 private:
  // Methods share the tetrahedra of a body.
  Scene filled(const BodySpec& body, const Scene& scene, const Candidate& c) {
    Scene one = alone(body, scene, c);
    if (!traits_of(c.method).needs_volume) return one;
    const auto [at, is_new] = volumes_.try_emplace({body.name, one.bodies[0].volume.tetrahedra});
    if (is_new) {
      Scene plain = one;
      plain.bodies[0].model = traits_of(Method::neo_hookean).model;
      at->second = std::move(fill_volumes(std::move(plain)).bodies[0]);
    }
    one.bodies[0].mesh = at->second.mesh;
    one.bodies[0].tets = at->second.tets;
    return one;
  }
  static Trial counted_up(Trial trial, const Candidate& c, double finer) {
    const double more = c.tetrahedra / kMostTried;
    trial.size.vertices *= more;
    trial.surface_vertices *= std::pow(more, 2.0 / 3);
    trial.size.elements *= finer * finer * finer;
    trial.size.part_limit_s /= finer;
    return trial;
  }

  static constexpr double kMostTried = 2500;
  std::map<std::tuple<std::string, Method, double, double>, std::pair<Trial, double>> known_;
  std::map<std::pair<std::string, double>, BodySpec> volumes_;
};

double surface_limit_s(const BodySpec& body, const Scene& scene) {
  Candidate c;
  c.step_s = 1e-7;  // any surface may have it
  const Scene one = alone(body, scene, c);
  return Body(one.bodies[0], one, 0, surface_spring_engines).engines.deformation->largest_stable_step_s();
}

planning::PlanInput input_of(BodySpec& body, const Scene& scene) {
  planning::PlanInput in;
  in.body = body.name;
  in.budgets = {body.plan.error_budget, body.plan.cpu_budget};
  in.material = body.material;
  in.has_tools = !scene.tools.empty();
  TriangleSoup surface = body.mesh;
  if (!body.volume.file.empty()) {
    Candidate c;
    c.method = Method::neo_hookean;
    const Scene one = fill_volumes(alone(body, scene, c));
    surface = one.bodies[0].mesh;
    in.given_tetrahedra = static_cast<double>(one.bodies[0].tets.tetrahedra.size());
    in.no_surface = "the scene brings tetrahedra";
  }
  if (body.cutting.style == "semi_progressive") in.no_surface = "semi_progressive cuts tetrahedra";
  if (body.cutting.style == "templates" || body.contact.style == "templates")
    in.no_volume = "templates are of surfaces";
  in.shape = planning::shape_of(surface);
  BodySpec with_surface = body;
  with_surface.mesh = std::move(surface);
  in.loads = planning::loads_on(with_surface.mesh, in.shape, situation_of(with_surface, scene));
  if (in.no_surface.empty())
    in.surface_limit_s = surface_limit_s(body, scene), in.most_surface_parts = SurfaceSprings::kMostParts;
  if (!in.no_surface.empty() && !in.no_volume.empty())
    throw InputError("no model does both: " + in.no_surface + ", and " + in.no_volume);
  return in;
}

struct Choice {
  std::vector<planning::PlanInput> inputs;  // of the bodies that are auto, in order
  std::vector<planning::BodyPlan> plans;
  double worst = 0;  // of what they ask for over what they may
};

Choice choose(const Scene& scene, std::vector<planning::PlanInput> inputs, double step_s,
              const planning::Calibration& calibration, Trials& trials) {
  Choice choice;
  choice.inputs = std::move(inputs);
  std::size_t n = 0;
  for (const BodySpec& body : scene.bodies) {
    if (!is_auto(body)) continue;
    planning::PlanInput& in = choice.inputs[n++];
    in.step_s = step_s;
    choice.plans.push_back(planning::plan(
        in, calibration, [&](const Candidate& c) { return trials.of(body, scene, c).in_steps_of(c.step_s); }));
    const Candidate& taken = choice.plans.back().chosen;
    choice.worst = std::max({choice.worst, taken.error / in.budgets.error, taken.cpu / in.budgets.cpu});
  }
  return choice;
}

// Every model divides a step into as many parts as it needs, surface springs into no more than a few.
bool is_stable(const Scene& scene, double step_s) {
  const EngineTable table = standard_engines();
  return std::ranges::all_of(scene.bodies, [&](const BodySpec& body) {
    const ModelEntry* model = table.find_model(body.model);
    return !model || model->traits.needs_volume || SurfaceSprings::kMostParts * surface_limit_s(body, scene) >= step_s;
  });
}

// The longest step that all bodies can take, where the scene leaves it to the program and no body waits for a plan.
Scene with_step(Scene scene) {
  if (!scene.step_is_free) return scene;
  const auto longest = std::ranges::find_if(kFreeSteps_s, [&](double step_s) { return is_stable(scene, step_s); });
  if (longest == std::end(kFreeSteps_s)) throw InputError(scene.file + kNoStep);
  scene.step_s = *longest;
  return scene;
}

}  // namespace

PlannedScene plan_scene(Scene scene, bool anew) {
  if (std::ranges::none_of(scene.bodies, is_auto)) return {with_step(std::move(scene)), {}};
  return plan_scene(std::move(scene), calibration_of_this_machine(anew));
}

PlannedScene plan_scene(Scene scene, const planning::Calibration& speed) {
  std::vector<planning::PlanInput> inputs;
  for (BodySpec& body : scene.bodies) {
    try {
      if (is_auto(body)) inputs.push_back(input_of(body, scene));
    } catch (const InputError& error) {
      throw InputError(scene.file + ": body '" + body.name + "': " + error.what());
    }
  }
  std::vector<double> steps_s{scene.step_s};
  if (scene.step_is_free) steps_s.assign(std::begin(kFreeSteps_s), std::end(kFreeSteps_s));
  std::optional<Choice> best;
  Trials trials;
  for (const double step_s : steps_s) {
    if (scene.step_is_free && !is_stable(scene, step_s)) continue;
    Choice choice = choose(scene, inputs, step_s, speed, trials);
    if (!best || choice.worst < best->worst) {
      best = std::move(choice);
      scene.step_s = step_s;
    }
    if (best->worst <= 1) break;
  }
  if (!best) throw InputError(scene.file + kNoStep);
  PlannedScene planned{std::move(scene), {}};
  std::size_t n = 0;
  for (BodySpec& body : planned.scene.bodies) {
    if (!is_auto(body)) continue;
    const planning::BodyPlan& plan = best->plans[n];
    planned.table += planning::to_text(best->inputs[n++], plan);
    body = alone(body, planned.scene, plan.chosen).bodies[0];
    body.plan.error_estimate = plan.chosen.error;
    body.plan.cpu_estimate = plan.chosen.cpu;
  }
  return planned;
}

Scene planned(Scene scene) {
  PlannedScene plan = plan_scene(std::move(scene));
  std::istringstream lines(plan.table);
  for (std::string line; std::getline(lines, line);) log_info(line);
  return std::move(plan.scene);
}

}  // namespace sectio
