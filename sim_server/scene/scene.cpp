#include "sim_server/scene/scene.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "common/core/error.h"
#include "sim_server/scene/mesh_import.h"
#include "sim_server/scene/region_reader.h"
#include "sim_server/scene/yaml_reader.h"

namespace sectio {
namespace {

constexpr double kMostSnapRatio = 0.15;  // above, crumbs come off

namespace fs = std::filesystem;

// No part of a patient is larger or smaller: a mesh that is has another unit than the scene says.
constexpr double kSmallestBody_m = 1e-3;
constexpr double kLargestBody_m = 5;
constexpr double kMostGravity = 1000;  // m/s2

std::string resolved(const YamlValue& file, const std::string& scene_file) {
  return (fs::path(scene_file).parent_path() / file.text()).lexically_normal().string();
}

// A name that is safe in topic partitions and file names.
std::string name_of(const YamlValue& value) {
  const std::string name = value.text();
  const auto allowed = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.'; };
  if (name.size() > 64 || !std::all_of(name.begin(), name.end(), allowed) || name.front() == '.') {
    value.fail("expected a name of at most 64 letters, digits, _, - and ., got " + name.substr(0, 64));
  }
  return name;
}

template <class Named>
void unique_name(const YamlValue& value, const std::vector<Named>& others, const std::string& name) {
  for (const Named& other : others) {
    if (other.name == name) value.fail("the name " + name + " is used twice");
  }
}

Camera read_camera(YamlMap& map) {
  Camera camera;
  map.read("eye_world_m", camera.eye_world_m);
  map.read("target_world_m", camera.target_world_m);
  map.read("up_world", camera.up_world);
  map.read("field_of_view_deg", camera.field_of_view_deg, between(1, 150));
  const Vec3 view = camera.target_world_m - camera.eye_world_m;
  if (view.norm() < 1e-6) map.value().fail("eye_world_m and target_world_m are the same point");
  if (view.cross(camera.up_world).norm() < 1e-6 * view.norm()) map.value().fail("up_world points along the view");
  return camera;
}

Pose read_pose(YamlMap& map) {
  Pose pose;
  map.read("position_world_m", pose.position_m);
  pose.orientation = read_rotation(map);
  return pose;
}

MaterialSpec read_material(YamlMap& map) {
  MaterialSpec material;
  map.read("young_pa", material.young_pa, above(0));
  map.read("poisson", material.poisson, from_to_below(0, 0.5));
  map.read("density_kg_per_m3", material.density_kg_per_m3, above(0));
  map.read("skin_thickness_m", material.skin_thickness_m, above(0));
  map.read("foundation_radius_m", material.foundation_radius_m, above(0));
  map.read("pretension", material.pretension, between(0, 0.5));
  map.read("damping_per_s", material.damping_per_s, at_least(0));
  map.read("toughness_j_per_m2", material.toughness_j_per_m2, at_least(0));
  return material;
}

CuttingSpec read_cutting(YamlMap& map) {
  CuttingSpec cutting;
  const auto force = map.find("threshold_force_n"), displacement = map.find("threshold_displacement_m");
  if (force && displacement) displacement->fail("give threshold_force_n or threshold_displacement_m, not both");
  if (force) cutting.threshold_force_n = force->number(at_least(0));
  if (displacement) {
    cutting.threshold_displacement_m = displacement->number(at_least(0));
    cutting.threshold_force_n.reset();
  }
  map.read("style", cutting.style, {"progressive", "templates", "semi_progressive"});
  map.read("open_top_m", cutting.open_top_m, above(0));
  map.read("open_bottom_m", cutting.open_bottom_m, above(0));
  map.read("hysteresis", cutting.hysteresis, above_to(0, 1));
  map.read("join_tolerance_m", cutting.join_tolerance_m, at_least(0));
  map.read("groove_min_depth_m", cutting.groove_min_depth_m, above(0));
  map.read("loops_free_islands", cutting.loops_free_islands);
  map.read("snap_ratio", cutting.snap_ratio, between(0, kMostSnapRatio));
  return cutting;
}

SplittingSpec read_splitting(YamlMap& map) {
  SplittingSpec splitting;
  if (const auto value = map.find("free_parts")) {
    const std::string choice = value->choice({"keep", "rigid", "deformable"});
    splitting.free_parts = choice == "keep"    ? FreeParts::keep
                           : choice == "rigid" ? FreeParts::rigid
                                               : FreeParts::deformable;
  }
  map.read("least_volume_m3", splitting.least_volume_m3, at_least(0));
  map.read("friction", splitting.friction, at_least(0));
  return splitting;
}

Box read_box(YamlMap& map) {
  const Box box{map.require("min_world_m").vector3(), map.require("max_world_m").vector3()};
  if (!(box.min_world_m.array() < box.max_world_m.array()).all()) {
    map.value().fail("each number of min_world_m must be below that of max_world_m");
  }
  return box;
}

double unit_m(const YamlValue& unit) {
  const std::string name = unit.choice({"m", "cm", "mm"});
  return name == "m" ? 1 : name == "cm" ? 0.01 : 0.001;
}

VolumeSpec read_volume(YamlMap& map, const std::string& scene_file) {
  VolumeSpec volume;
  map.read("mesher", volume.mesher, {"lattice", "tetgen", "best"});
  map.read("tetrahedra", volume.tetrahedra, between(12, 5e6));
  map.read("cell_m", volume.cell_m, between(1e-5, 1));
  map.read("driver", volume.driver, {"automatic", "implicit"});
  map.read("second_share", volume.second_share, between(0, 0.95));
  map.read("damper_s", volume.damper_s, at_least(0));
  map.read("floor_kept_velocity", volume.floor_kept_velocity, between(0, 1));
  map.read("least_part_s", volume.least_part_s, between(0, 0.1));
  map.read("collapse_ratio", volume.collapse_ratio, between(0, 0.8));
  map.part("tets", [&](YamlMap& part) {
    volume.file = resolved(part.require("file"), scene_file);
    volume.file_unit_m = unit_m(part.require("unit"));
  });
  return volume;
}

void read_mesh(YamlMap& map, const std::string& scene_file, BodySpec& body) {
  const YamlValue file = map.require("file"), unit = map.require("unit");
  body.mesh_unit_m = unit_m(unit);
  body.mesh_file = resolved(file, scene_file);
  ImportedMesh mesh;
  try {
    mesh = import_mesh(body.mesh_file, body.mesh_unit_m);
  } catch (const InputError& error) {
    file.fail(error.what());
  }
  body.mesh = std::move(mesh.soup);
  body.mesh_notes = std::move(mesh.mended);
  if (mesh.report.components > 1) {
    body.mesh_notes.push_back(std::to_string(mesh.report.components) + " separate parts");
  }
  Eigen::AlignedBox3d box;
  for (const Vec3& p : body.mesh.vertices_body_m) box.extend(p);
  const double size_m = box.diagonal().norm();
  if (size_m < kSmallestBody_m || size_m > kLargestBody_m) {
    unit.fail("the mesh would be " + std::to_string(size_m) + " m across; is its unit another one?");
  }
}

// Whatever model it will be, or is.
bool may_be_a_surface(const BodySpec& body) {
  return body.model == "surface_springs" || body.model == "auto";
}

void read_plan(YamlMap& map, BodySpec& body) {
  for (const char* key : {"error_budget", "cpu_budget"})
    if (const auto value = map.find(key); value && body.model != "auto") value->fail("it is of model auto");
  map.read("error_budget", body.plan.error_budget, above_to(0, 10));
  map.read("cpu_budget", body.plan.cpu_budget, above_to(0, 1000));
}

BodySpec read_body(YamlMap& map, const std::string& scene_file) {
  BodySpec body;
  body.name = name_of(map.require("name"));
  if (const auto server = map.find("server")) body.server = name_of(*server);
  map.read("model", body.model, {"surface_springs", "tetra_springs", "neo_hookean", "neo_hookean_lattice", "auto"});
  read_plan(map, body);
  map.part("pose", [&](YamlMap& part) { body.pose = read_pose(part); });
  map.part("material", [&](YamlMap& part) { body.material = read_material(part); });
  map.part("contact", [&](YamlMap& part) {
    part.read("style", body.contact.style, {"vertices", "templates"});
    if (body.contact.style == "templates" && !may_be_a_surface(body))
      part.value().fail("templates divide a surface: they need the model surface_springs");
  });
  map.part("cutting", [&](YamlMap& part) {
    body.cutting = read_cutting(part);
    if (body.cutting.style == "semi_progressive" && body.model == "surface_springs")
      part.value().fail("semi_progressive cuts tetrahedra: it needs a model with a volume");
    if (body.cutting.style == "templates" && !may_be_a_surface(body))
      part.value().fail("templates cut a surface: they need the model surface_springs");
    if (part.find("snap_ratio") && body.model == "surface_springs")
      part.value().fail("snap_ratio is of tetrahedra: it needs a model with a volume");
  });
  map.part("splitting", [&](YamlMap& part) { body.splitting = read_splitting(part); });
  map.part("fixed", [&](YamlMap& part) { body.fixed = read_box(part); });
  map.part("colours", [&](YamlMap& part) {
    part.read("skin", body.skin_colour, between(0, 1));
    part.read("wall", body.wall_colour, between(0, 1));
  });
  if (const auto regions = map.find("regions")) body.regions = read_regions(*regions);
  if (const auto volume = map.find("volume")) {
    if (body.model == "surface_springs") volume->fail("the model surface_springs has no volume");
    YamlMap part(*volume);
    body.volume = read_volume(part, scene_file);
    for (const char* chosen : {"tetrahedra", "cell_m", "driver"})
      if (const auto value = part.find(chosen); value && body.model == "auto") value->fail("model auto chooses it");
    part.finish();
  }
  if (!body.volume.file.empty()) {
    map.finish();
    return body;
  }
  YamlMap mesh(map.require("mesh"));
  map.finish();
  read_mesh(mesh, scene_file, body);
  mesh.finish();
  return body;
}

ToolGeometry read_geometry(YamlMap& map, ToolGeometry geometry) {
  map.read("a_tool_m", geometry.a_tool_m);
  map.read("b_tool_m", geometry.b_tool_m);
  map.read("c_tool_m", geometry.c_tool_m);
  map.read("d_tool_m", geometry.d_tool_m);
  map.read("sharp_length_m", geometry.sharp_length_m, above(0));
  map.read("gauge_m", geometry.gauge_m, above(0));
  map.read("sphere_radius_m", geometry.sphere_radius_m, above_to(0, 0.1));
  return geometry;
}

void read_grip(YamlMap& map, const InstrumentKind& instrument, ToolSpec& tool) {
  if (instrument.grip_force_n == 0) return;
  if (const auto force = map.find("grip_force_n")) tool.grip_force_n = force->number(above_to(0, 1000));
  if (const auto radius = map.find("grip_radius_m")) tool.grip_radius_m = radius->number(above_to(0, 0.1));
  if (tool.grip_radius_m.value_or(instrument.grip_radius_m) <= tool.geometry.sphere_radius_m)
    map.value().fail("grip_radius_m must be more than sphere_radius_m: the ball pushes out what is held");
}

ToolSpec read_tool(YamlMap& map, const std::string& scene_file) {
  ToolSpec tool;
  tool.name = name_of(map.require("name"));
  tool.kind = map.require("kind").choice(instrument_kinds());
  const InstrumentKind& instrument = instrument_of(tool.kind);
  tool.geometry = instrument.geometry;
  map.part("geometry", [&](YamlMap& part) { tool.geometry = read_geometry(part, tool.geometry); });
  map.read("intensity", tool.intensity, above_to(0, 10));
  read_grip(map, instrument, tool);
  if (const std::string flaw = instrument.flaw(tool.geometry); !flaw.empty()) map.value().fail("geometry: " + flaw);
  const auto trace = map.find("trace");
  map.finish();
  if (!trace) return tool;
  tool.trace_file = resolved(*trace, scene_file);
  try {
    tool.trace = load_trace(tool.trace_file);
  } catch (const InputError& error) {
    trace->fail(error.what());
  }
  return tool;
}

ExerciseSpec read_exercise(const YamlValue& value, const std::vector<BodySpec>& bodies) {
  YamlMap map(value);
  const YamlValue name = map.require("body");
  ExerciseSpec exercise{name.text(), {}};
  const auto body = std::ranges::find(bodies, exercise.body, &BodySpec::name);
  if (body == bodies.end()) name.fail("there is no body " + exercise.body);
  if (std::ranges::none_of(body->regions, &Region::marked)) name.fail(exercise.body + " has no region that is marked");
  YamlMap bin(map.require("bin"));
  exercise.bin = read_box(bin);
  bin.finish();
  map.finish();
  return exercise;
}

SleepSpec read_sleep(YamlMap& map) {
  SleepSpec sleep;
  map.read("after_s", sleep.after_s, between(0, 60));
  map.read("still_m", sleep.still_m, at_least(0));
  map.read("unseen_px", sleep.unseen_px, at_least(0));
  return sleep;
}

std::vector<GravityChange> read_gravity_changes(const YamlValue& list) {
  std::vector<GravityChange> changes;
  for (const YamlValue& value : list.list()) {
    YamlMap map(value);
    GravityChange change;
    change.at_s = map.require("at_s").number(at_least(0));
    change.gravity_m_per_s2 = map.require("gravity_m_per_s2").vector3(between(-kMostGravity, kMostGravity));
    map.finish();
    if (!changes.empty() && change.at_s <= changes.back().at_s) value.fail("at_s must be later than the one before");
    changes.push_back(change);
  }
  return changes;
}

}  // namespace

Scene load_scene(const std::string& path) {
  Scene scene;
  scene.file = path;
  YamlMap map = load_yaml(path);
  scene.session = name_of(map.require("session"));
  const auto step = map.find("step_s");
  scene.step_is_free = step && step->is("auto");
  if (step && !scene.step_is_free) scene.step_s = step->number(above_to(0, 0.1));
  map.read("duration_s", scene.duration_s, above_to(0, 86400));
  map.read("gravity_m_per_s2", scene.gravity_m_per_s2, between(-kMostGravity, kMostGravity));
  if (const auto changes = map.find("gravity_changes")) scene.gravity_changes = read_gravity_changes(*changes);
  map.read("gravity_turns_deg_per_s", scene.gravity_turns_deg_per_s, above_to(0, 360));
  if (const auto floor = map.find("floor_z_m")) scene.floor_z_m = floor->number(between(-1000, 1000));
  map.part("sleep", [&](YamlMap& part) { scene.sleep = read_sleep(part); });
  map.part("camera", [&](YamlMap& part) { scene.camera = read_camera(part); });
  const YamlValue bodies = map.require("bodies");
  const auto tools = map.find("tools"), exercise = map.find("exercise");
  map.finish();

  if (tools) {
    for (const YamlValue& value : tools->list()) {
      YamlMap entry(value);
      ToolSpec tool = read_tool(entry, path);
      unique_name(value, scene.tools, tool.name);
      scene.tools.push_back(std::move(tool));
    }
  }
  for (const YamlValue& value : bodies.list()) {
    YamlMap entry(value);
    BodySpec body = read_body(entry, path);
    unique_name(value, scene.bodies, body.name);
    scene.world_bodies.push_back(body.name);
    scene.bodies.push_back(std::move(body));
  }
  if (scene.step_is_free && std::ranges::find(scene.bodies, "auto", &BodySpec::model) == scene.bodies.end())
    step->fail("auto needs a body with model auto");
  if (exercise) scene.exercise = read_exercise(*exercise, scene.bodies);
  return scene;
}

void keep_bodies(Scene& scene, const std::vector<std::string>& names, const std::string& who) {
  for (const std::string& name : names)
    if (std::ranges::find(scene.bodies, name, &BodySpec::name) == scene.bodies.end())
      throw InputError(who + ": there is no body " + name + " in " + scene.file);
  std::erase_if(scene.bodies, [&](const BodySpec& body) { return std::ranges::find(names, body.name) == names.end(); });
  if (scene.bodies.empty()) throw InputError(who + ": there are no bodies for it in " + scene.file);
  if (scene.exercise && std::ranges::find(scene.bodies, scene.exercise->body, &BodySpec::name) == scene.bodies.end())
    scene.exercise.reset();
}

}  // namespace sectio
