#include "sim_server/scene/scene.h"

#include <algorithm>
#include <filesystem>

#include "common/core/error.h"
#include "common/core/most_gravity.h"
#include "sim_server/scene/body_reader.h"
#include "sim_server/scene/mesh_import.h"
#include "sim_server/scene/tool_reader.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;

// Adds what was read; no two may have the same name.
template <class Named>
void add(std::vector<Named>& list, Named entry, const KeyReader& map) {
  map.finish();
  map.check(std::ranges::find(list, entry.name, &Named::name) == list.end(),
            "the name " + entry.name + " is used twice");
  list.push_back(std::move(entry));
}

void read_camera(KeyReader& map, Camera& camera) {
  map.vector("eye_world_m", camera.eye_world_m, {}, "Where the camera is.");
  map.vector("target_world_m", camera.target_world_m, {}, "The point in the middle of the picture.");
  map.vector("up_world", camera.up_world, {}, "The direction that is up in the picture.");
  map.number("field_of_view_deg", camera.field_of_view_deg, between(1, 150),
             "Vertical angle of view; pictures narrower than 4:3 show more above and below.");
  const Vec3 view = camera.target_world_m - camera.eye_world_m;
  map.check(view.norm() >= 1e-6, "eye_world_m and target_world_m are the same point");
  map.check(view.cross(camera.up_world).norm() >= 1e-6 * view.norm(), "up_world points along the view");
}

void read_sleep(KeyReader& map, SleepSpec& sleep) {
  map.number("after_s", sleep.after_s, between(0, 60), "How long it must have been at rest; 0: no body sleeps.");
  map.number("still_m", sleep.still_m, at_least(0), "A surface that moves no further than this is at rest.");
  map.number("unseen_px", sleep.unseen_px, at_least(0),
             "The same in pixels of the scene's camera, 720 lines high, where that is further.");
}

void read_gravity(KeyReader& map, Scene& scene) {
  const Range range = between(-kMostGravity_m_per_s2, kMostGravity_m_per_s2);
  map.vector("gravity_m_per_s2", scene.gravity_m_per_s2, range, "Gravity at the beginning.");
  map.each(
      "gravity_changes",
      [&](KeyReader& entry) {
        GravityChange change;
        entry.required().number("at_s", change.at_s, at_least(0), "Simulated time at which gravity begins to turn.");
        entry.required().vector("gravity_m_per_s2", change.gravity_m_per_s2, range, "Gravity in the end.");
        entry.finish();
        entry.check(scene.gravity_changes.empty() || change.at_s > scene.gravity_changes.back().at_s,
                    "at_s must be later than the one before");
        scene.gravity_changes.push_back(change);
      },
      "The patient is tilted: gravity turns, in the patient's frame.");
  map.number("gravity_turns_deg_per_s", scene.gravity_turns_deg_per_s, above_to(0, 360), "How fast it turns at most.");
}

void read_process(KeyReader& map, Scene& scene, const EngineTraits& traits) {
  ProcessSpec process;
  std::vector<std::string> kinds;
  for (const ProcessTraits& kind : traits.processes) kinds.push_back(kind.kind);
  map.required().name("name", process.name, "Its name, which no other process has.");
  map.required().choice("kind", process.kind, kinds, "Kind of process.");
  map.required().names("bodies", process.bodies, "Names of the bodies in which, or between which, it goes on.");
  std::vector<KeyReader::Owner> owners;
  for (const ProcessTraits& kind : traits.processes)
    owners.push_back({"kind " + kind.kind, kind.kind == process.kind, kind.keys});
  map.options(std::move(owners), process.options);
  for (auto name = process.bodies.begin(); name != process.bodies.end(); ++name) {
    map.check("bodies", std::ranges::find(scene.bodies, *name, &BodySpec::name) != scene.bodies.end(),
              "there is no body " + *name);
    map.check("bodies", std::find(process.bodies.begin(), name, *name) == name, "the body " + *name + " stands twice");
  }
  const auto kind = std::ranges::find(traits.processes, process.kind, &ProcessTraits::kind);
  if (kind != traits.processes.end()) {
    const std::size_t count = process.bodies.size();
    map.check("bodies", count >= kind->fewest_bodies && count <= kind->most_bodies,
              process.kind + " takes " + std::to_string(kind->fewest_bodies) + " to " +
                  std::to_string(kind->most_bodies) + " bodies, got " + std::to_string(count));
  }
  add(scene.processes, std::move(process), map);
}

constexpr double kShortestLine_m = 1e-4;

LineSpec read_line(KeyReader& map, const Regions& regions) {
  LineSpec line;
  std::string name;
  map.required().text("region", name, "Name of a region of the body, whose tubes are the line, end to end.");
  map.number("depth_m", line.depth_m, above_to(0, 0.1), "How deep the cut should be.");
  map.number("within_m", line.within_m, above_to(0, 0.1), "A cut that is as near as this follows the line.");
  const auto region = std::ranges::find(regions, name, &Region::name);
  map.check("region", region != regions.end(), "the body has no region " + name);
  if (region == regions.end()) return line;
  for (const RegionPart& part : region->parts)
    if (part.form == RegionForm::tube) line.points_body_m.insert(line.points_body_m.end(), {part.a_m, part.b_m});
  map.check("region", !line.points_body_m.empty(), name + " has no tubes");
  const auto& at = line.points_body_m;
  const bool is_a_point = std::ranges::all_of(at, [&](const Vec3& p) { return (p - at[0]).norm() < kShortestLine_m; });
  map.check("region", at.empty() || !is_a_point, "the tubes of " + name + " have no length");
  return line;
}

ExerciseSpec read_exercise(KeyReader& map, const std::vector<BodySpec>& bodies) {
  ExerciseSpec exercise;
  map.required().text("body", exercise.body, "Name of the body to work on.");
  map.text("task", exercise.task, "What to do, in a sentence for the person who does it.");
  map.check("task", exercise.task.size() <= ExerciseSpec::kMostTaskBytes,
            "more than " + std::to_string(ExerciseSpec::kMostTaskBytes) + " bytes");
  const auto body = std::ranges::find(bodies, exercise.body, &BodySpec::name);
  map.check("body", body != bodies.end(), "there is no body " + exercise.body);
  static const Regions none;
  const Regions& regions = body == bodies.end() ? none : body->regions;
  map.part(
      "bin", [&](KeyReader& part) { exercise.bin = read_box(part); },
      "A box for the marked tissue of the body; a part that lies in it is in the bin, also if a tenth hangs over its "
      "rim.");
  map.part(
      "line", [&](KeyReader& part) { exercise.line = read_line(part, regions); }, "A line on the body to cut along.");
  map.names("spare", exercise.spare, "Names of bodies that no instrument should touch.");
  for (const std::string& name : exercise.spare)
    map.check("spare", name != exercise.body && std::ranges::find(bodies, name, &BodySpec::name) != bodies.end(),
              "there is no other body " + name);
  if (exercise.bin && body != bodies.end())
    map.check("body", std::ranges::any_of(regions, &Region::marked), exercise.body + " has no region that is marked");
  map.check("body", exercise.bin || exercise.line, "there is neither a bin nor a line");
  return exercise;
}

// Why the scene can't have the measure; empty: it can.
std::string flaw_of(const Measure& measure, const Scene& scene) {
  if (measure.of == MeasureOf::run) return {};
  if (!scene.exercise) return "the scene has no exercise";
  const auto body = std::ranges::find(scene.bodies, scene.exercise->body, &BodySpec::name);
  const bool is_marked = body != scene.bodies.end() && std::ranges::any_of(body->regions, &Region::marked);
  if (measure.of == MeasureOf::marked_tissue && !is_marked)
    return scene.exercise->body + " has no region that is marked";
  if (measure.of == MeasureOf::bin && !scene.exercise->bin) return "the exercise has no bin";
  if (measure.of == MeasureOf::line && !scene.exercise->line) return "the exercise has no line";
  return {};
}

void read_expectations(KeyReader& map, Scene& scene) {
  for (const Measure& measure : measures()) {
    std::optional<Range> range;
    map.range(measure.key, range, measure.possible, measure.meaning);
    const std::string flaw = flaw_of(measure, scene);
    map.check(measure.key, flaw.empty(), flaw);
    if (range) scene.expect.push_back({&measure, *range});
  }
}

// The longest: two pictures' worth at 60 a second, in which a hand goes 33 mm at its fastest.
constexpr double kShortestStep_s = 1e-6, kLongestStep_s = 0.0334;

void read_scene(KeyReader& map, const EngineTraits& traits, Scene& scene) {
  map.required().name("session", scene.session, "Name of the session on the network.");
  map.number_or(
      "auto", scene.step_is_free, "step_s", scene.step_s, between(kShortestStep_s, kLongestStep_s),
      "Length of a step. A hand needs 0.001; steps of 0.008 to 0.033 with driver implicit are for bodies that "
      "instruments touch slowly or not at all. Models divide it into as many parts as they need; where the springs of "
      "a surface would need more than 32, it is refused with the largest that would do. auto: the program chooses it, "
      "with the models where these are auto.");
  scene.step_place = map.place("step_s");
  map.number("duration_s", scene.duration_s, above_to(0, 86400), "Simulated time of a run.");
  read_gravity(map, scene);
  map.number("floor_z_m", scene.floor_z_m, between(-1000, 1000), "Height of the floor; without it there is none.");
  map.part(
      "sleep", [&](KeyReader& part) { read_sleep(part, scene.sleep); },
      "When a body that has come to rest is not simulated until something touches it.");
  map.part(
      "camera", [&](KeyReader& part) { read_camera(part, scene.camera); }, "The first view on the scene.");
  map.each(
      "tools", [&](KeyReader& entry) { add(scene.tools, read_tool(entry), entry); }, "The instruments.");
  map.required().each(
      "bodies", [&](KeyReader& entry) { add(scene.bodies, read_body(entry, traits), entry); }, "The tissue.");
  if (!traits.processes.empty())
    map.each(
        "processes", [&](KeyReader& entry) { read_process(entry, scene, traits); },
        "Processes in bodies or between them, such as bleeding.");
  map.part(
      "exercise", [&](KeyReader& part) { scene.exercise = read_exercise(part, scene.bodies); },
      "Marked tissue is to be removed from a body and put into a bin, or a line to be cut; the report has the score.");
  map.part(
      "expect", [&](KeyReader& part) { read_expectations(part, scene); },
      "What the scene is about: a run for its whole duration must come to this; the report has all of these numbers.");
}

// At the value that names the file.
template <class F>
void name_place(const YamlValue& place, F read_file) {
  try {
    read_file();
  } catch (const InputError& error) {
    place.fail(error.what());
  }
}

void import_surface(BodySpec& body, const YamlValue& file, const YamlValue& unit) {
  ImportedMesh mesh;
  name_place(file, [&] {
    mesh = body.wrapped ? import_wrapped(body.mesh_file, body.mesh_unit_m, {body.mesh_part, body.mesh_size_m})
                        : import_mesh(body.mesh_file, body.mesh_unit_m);
  });
  body.mesh = std::move(mesh.soup);
  body.mesh_notes = std::move(mesh.mended);
  if (mesh.report.components > 1) body.mesh_notes.push_back(std::to_string(mesh.report.components) + " separate parts");
  if (const std::string flaw = flaw_of_size(body.mesh.vertices_body_m); !flaw.empty()) unit.fail(flaw);
}

// Meshes and traces, once every key is known to be good.
void read_files(Scene& scene, const KeyReader& map) {
  const auto resolve = [&](std::string& file) {
    if (!file.empty()) file = (fs::path(scene.file).parent_path() / file).lexically_normal().string();
  };
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    ToolSpec& tool = scene.tools[i];
    resolve(tool.trace_file);
    if (const auto trace = KeyReader(map.given("tools")->list()[i]).given("trace"))
      name_place(*trace, [&] { tool.trace = load_trace(tool.trace_file); });
  }
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    BodySpec& body = scene.bodies[i];
    resolve(body.mesh_file);
    resolve(body.volume.file);
    const auto mesh = KeyReader(map.given("bodies")->list()[i]).given("mesh");
    if (!mesh) continue;
    const KeyReader keys(*mesh);
    import_surface(body, *keys.given("file"), *keys.given("unit"));
  }
}

}  // namespace

Scene load_scene(const std::string& path, const EngineTraits& traits) {
  Scene scene;
  scene.file = path;
  KeyReader map(load_yaml(path));
  read_scene(map, traits, scene);
  map.finish();
  for (const BodySpec& body : scene.bodies) scene.world_bodies.push_back(body.name);
  read_files(scene, map);
  return scene;
}

std::vector<Key> describe_scene(const EngineTraits& traits) {
  KeyReader map;
  Scene scene;
  read_scene(map, traits, scene);
  return map.keys();
}

void keep_bodies(Scene& scene, const std::vector<std::string>& names, const std::string& who) {
  for (const std::string& name : names)
    if (std::ranges::find(scene.bodies, name, &BodySpec::name) == scene.bodies.end())
      throw InputError(who + ": there is no body " + name + " in " + scene.file);
  const auto is_kept = [&](const std::string& body) { return std::ranges::find(names, body) != names.end(); };
  std::erase_if(scene.bodies, [&](const BodySpec& body) { return !is_kept(body.name); });
  if (scene.bodies.empty()) throw InputError(who + ": there are no bodies for it in " + scene.file);
  if (scene.bodies.size() < scene.world_bodies.size()) scene.expect.clear();  // they are of all bodies
  if (scene.exercise && !is_kept(scene.exercise->body)) scene.exercise.reset();
  std::erase_if(scene.processes, [&](const ProcessSpec& p) { return std::ranges::none_of(p.bodies, is_kept); });
  for (const ProcessSpec& process : scene.processes)
    if (!std::ranges::all_of(process.bodies, is_kept))
      throw InputError(who + ": the process " + process.name + " goes on between bodies of several servers");
}

}  // namespace sectio
