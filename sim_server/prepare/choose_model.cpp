#include "sim_server/prepare/choose_model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <sstream>
#include <tuple>

#include "common/core/error.h"
#include "common/core/log.h"
#include "sim_server/planning/plan.h"
#include "sim_server/prepare/fill_volumes.h"
#include "sim_server/prepare/kept_plans.h"
#include "sim_server/prepare/machine_speed.h"
#include "sim_server/prepare/try_candidates.h"
#include "sim_server/world/body.h"

namespace sectio {
namespace {

using planning::Candidate;
using planning::Method;

constexpr std::size_t kMoments = 150;  // moments of a trace that are looked at
constexpr double kOnFloor_m = 1e-3;
constexpr double kFreeSteps_s[] = {1e-3, 5e-4, 2.5e-4};
constexpr const char* kNoStep = ": no step is short enough for the bodies with surface springs";

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
  for (const TracePoint& at : moments_of(tool.trace, kMoments)) {
    const InstrumentShape shape = kind.shape(tool.geometry, {tool.intensity, at.opening_rad, 0});
    const auto local = [&](const Vec3& p) { return body.to_local(at.pose_world.to_world(p)); };
    use.moments.push_back({local(use.cuts ? shape.edge_tip_tool_m : shape.a_tool_m), local(shape.b_tool_m),
                           body.orientation.conjugate() * at.pose_world.orientation,
                           at.opening_rad < kind.grip_below_rad, at.time_s});
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

// With a model of the surface.
double surface_limit_s(const BodySpec& body, const Scene& scene, const Method& method, const EngineTable& engines) {
  Candidate c;
  c.method = &method;
  c.step_s = 1e-7;  // any surface may have it
  const Scene one = alone(body, scene, c);
  return Body(one.bodies[0], one, 0, engines.model(method.model).make).engines.deformation->largest_stable_step_s();
}

// A body to plan for: as its candidates are on trial, and as planning knows it.
struct Subject {
  OnTrial body;
  planning::PlanInput in;
};

Subject subject_of(const BodySpec& body, const Scene& scene, std::span<const Method> methods,
                   const EngineTable& engines) {
  planning::PlanInput in;
  in.body = body.name;
  in.methods = methods;
  in.budgets = {body.plan.error_budget, body.plan.cpu_budget};
  in.material = body.material;
  in.has_tools = !scene.tools.empty();
  TriangleSoup surface = body.mesh;
  if (!body.volume.file.empty()) {
    BodySpec filled = body;
    fill_volume(filled);
    surface = filled.mesh;
    in.given_tetrahedra = static_cast<double>(filled.tets.tetrahedra.size());
    in.no_surface = "the scene brings tetrahedra";
  }
  if (body.cutting.style == "semi_progressive") in.no_surface = "semi_progressive cuts tetrahedra";
  if (body.cutting.style == "templates" || body.contact.style == "templates")
    in.no_volume = "templates are of surfaces";
  in.shape = planning::shape_of(surface);
  BodySpec with_surface = body;
  with_surface.mesh = std::move(surface);
  const planning::BodySituation situation = situation_of(with_surface, scene);
  in.loads = planning::loads_on(with_surface.mesh, in.shape, situation);
  in.strokes = planning::strokes_in(with_surface.mesh, in.shape, situation);
  in.is_held = !situation.fixed_m.empty();
  in.gripped_share = planning::gripped_share(with_surface.mesh, situation);
  std::optional<Vec3> gravity_body;
  if (in.is_held && !situation.lies_on_floor && situation.most_gravity_m_per_s2 > 0)
    gravity_body = situation.most_gravity_m_per_s2 * situation.down_body;
  const auto surface_method = std::ranges::find_if(methods, [](const Method& m) { return !m.needs_volume(); });
  if (in.no_surface.empty() && surface_method != methods.end())
    in.surface_limit_s = surface_limit_s(body, scene, *surface_method, engines);
  if (!in.no_surface.empty() && !in.no_volume.empty())
    throw InputError("no model does both: " + in.no_surface + ", and " + in.no_volume);
  return {{std::move(with_surface), in.shape, gravity_body}, std::move(in)};
}

struct Choice {
  std::vector<planning::PlanInput> inputs;  // inputs for the auto bodies, in order
  std::vector<planning::BodyPlan> plans;
  double worst = 0;  // the bodies' demand over their budget
};

Choice choose(const std::vector<Subject>& subjects, double step_s, const planning::Calibration& calibration,
              Trials& trials) {
  Choice choice;
  for (const Subject& subject : subjects) {
    planning::PlanInput& in = choice.inputs.emplace_back(subject.in);
    in.step_s = step_s;
    choice.plans.push_back(
        planning::plan(in, calibration, [&](const Candidate& c) { return trials.of(subject.body, c); }));
    const Candidate& taken = choice.plans.back().chosen;
    choice.worst = std::max({choice.worst, taken.error / in.budgets.error, taken.most_cpu() / in.budgets.cpu});
  }
  return choice;
}

// A model of a volume divides a step into as many parts as it needs, one of the surface into no more than a few.
bool is_stable(const Scene& scene, double step_s, std::span<const Method> methods, const EngineTable& engines) {
  return std::ranges::all_of(scene.bodies, [&](const BodySpec& body) {
    const auto method = std::ranges::find(methods, body.model, &Method::model);
    return method == methods.end() || method->needs_volume() ||
           method->most_parts * surface_limit_s(body, scene, *method, engines) >= step_s;
  });
}

// The longest step that all bodies can take, where the scene leaves it to the program and no body waits for a plan.
Scene with_step(Scene scene, const EngineTable& engines) {
  if (!scene.step_is_free) return scene;
  const std::vector<Method> methods = engines.methods();
  const auto longest =
      std::ranges::find_if(kFreeSteps_s, [&](double step_s) { return is_stable(scene, step_s, methods, engines); });
  if (longest == std::end(kFreeSteps_s)) throw InputError(place_of_step(scene) + kNoStep);
  scene.step_s = *longest;
  return scene;
}

KeptPlan made_plan(const Scene& scene, const EngineTable& engines, std::span<const Method> methods,
                   const planning::Calibration& speed) {
  std::vector<Subject> subjects;
  for (const BodySpec& body : scene.bodies) {
    try {
      if (is_auto(body)) subjects.push_back(subject_of(body, scene, methods, engines));
    } catch (const InputError& error) {
      throw InputError(place_of(body, scene) + ": " + error.what());
    }
  }
  std::vector<double> steps_s{scene.step_s};
  if (scene.step_is_free) steps_s.assign(std::begin(kFreeSteps_s), std::end(kFreeSteps_s));
  std::optional<Choice> best;
  Trials trials(scene, engines);
  for (const double step_s : steps_s) {
    if (scene.step_is_free && !is_stable(scene, step_s, methods, engines)) continue;
    Choice choice = choose(subjects, step_s, speed, trials);
    if (!best || choice.worst < best->worst) best = std::move(choice);
    if (best->worst <= 1) break;
  }
  if (!best) throw InputError(place_of_step(scene) + kNoStep);
  KeptPlan made;
  for (std::size_t i = 0; i < best->plans.size(); ++i) {
    const Candidate& c = best->plans[i].chosen;
    made.table += planning::to_text(best->inputs[i], best->plans[i]);
    made.choices.push_back({c.method->name, c.step_s, c.cell_m, c.tetrahedra, c.error, c.cpu, c.cut_cpu, c.cut_step_s});
  }
  return made;
}

// Nothing if the plan is not for such a scene, or has another method.
std::optional<PlannedScene> with_plan(Scene scene, std::span<const Method> methods, const KeptPlan& plan) {
  if (std::ranges::count_if(scene.bodies, is_auto) != std::ssize(plan.choices)) return std::nullopt;
  PlannedScene planned{std::move(scene), plan.table};
  auto choice = plan.choices.begin();
  for (BodySpec& body : planned.scene.bodies) {
    if (!is_auto(body)) continue;
    const auto method = std::ranges::find(methods, choice->method, &Method::name);
    if (method == methods.end()) return std::nullopt;
    Candidate c;
    c.method = &*method;
    planned.scene.step_s = c.step_s = choice->step_s;
    c.cell_m = choice->cell_m;
    c.tetrahedra = choice->tetrahedra;
    body = alone(body, planned.scene, c).bodies[0];
    body.plan.error_estimate = choice->error;
    body.plan.cpu_estimate = choice->cpu;
    if (choice->cut_cpu > 0) {
      body.plan.cut_cpu_estimate = choice->cut_cpu;
      body.plan.cut_step_estimate_s = choice->cut_step_s;
    }
    ++choice;
  }
  return planned;
}

}  // namespace

PlannedScene plan_scene(Scene scene, const EngineTable& engines, bool anew) {
  if (std::ranges::none_of(scene.bodies, is_auto)) return {with_step(std::move(scene), engines), {}};
  const std::vector<Method> methods = engines.methods();
  const planning::Calibration speed = calibration_of_this_machine(engines, anew);
  const std::uint64_t key = plan_key(scene, methods, to_text(speed, {}));
  if (const auto kept = anew ? std::nullopt : kept_plan(key))
    if (auto planned = with_plan(scene, methods, *kept)) return std::move(*planned);
  const KeptPlan made = made_plan(scene, engines, methods, speed);
  keep_plan(key, made);
  return *with_plan(std::move(scene), methods, made);
}

PlannedScene plan_scene(Scene scene, const EngineTable& engines, const planning::Calibration& speed) {
  const std::vector<Method> methods = engines.methods();
  const KeptPlan made = made_plan(scene, engines, methods, speed);
  return *with_plan(std::move(scene), methods, made);
}

Scene planned(Scene scene, const EngineTable& engines) {
  PlannedScene plan = plan_scene(std::move(scene), engines);
  std::istringstream lines(plan.table);
  for (std::string line; std::getline(lines, line);) log_info(line);
  return std::move(plan.scene);
}

}  // namespace sectio
