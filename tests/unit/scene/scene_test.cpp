#include "sim_server/scene/scene.h"

#include <map>

#include "sim_server/engine/standard_traits.h"
#include "tests/support/random.h"
#include "tests/unit/scene/scene_file.h"

namespace sectio::scene_test {
namespace {

namespace fs = std::filesystem;
using test::kScene;
using test::SceneFile;

TEST_F(SceneFile, every_key_arrives) {
  const Scene scene = load(kScene);
  EXPECT_EQ(scene.session, "test");
  EXPECT_EQ(scene.step_s, 0.002);
  EXPECT_EQ(scene.duration_s, 3);
  EXPECT_EQ(scene.gravity_m_per_s2, Vec3(0, 0, -1));
  EXPECT_EQ(scene.camera.eye_world_m, Vec3(0, -1, 1));
  EXPECT_EQ(scene.camera.field_of_view_deg, 40);
  ASSERT_EQ(scene.bodies.size(), 1u);
  const BodySpec& body = scene.bodies[0];
  EXPECT_EQ(body.name, "cube");
  EXPECT_EQ(body.mesh.triangles.size(), 12u);
  EXPECT_EQ(body.mesh_unit_m, 0.01);
  EXPECT_TRUE(body.pose.to_world(Vec3(0.01, 0, 0)).isApprox(Vec3(1, 2.01, 3), 1e-12));
  EXPECT_EQ(body.material.young_pa, 7000);
  EXPECT_EQ(body.material.density_kg_per_m3, MaterialSpec().density_kg_per_m3);
  EXPECT_EQ(body.cutting.threshold_force_n, 0.3);
  EXPECT_EQ(body.contact.style, "templates");
  EXPECT_EQ(body.cutting.hysteresis, 0.5);
  ASSERT_TRUE(body.fixed.has_value());
  EXPECT_EQ(body.fixed->max_world_m, Vec3(1, 1, 1));
  EXPECT_EQ(body.skin_colour, Vec3(1, 0, 0));
  ASSERT_EQ(scene.tools.size(), 2u);
  EXPECT_EQ(scene.tools[0].trace.size(), 2u);
  EXPECT_EQ(scene.tools[1].kind, "cautery_hook");
  EXPECT_EQ(scene.tools[1].intensity, 0.5);
  EXPECT_LT(scene.tools[1].geometry.d_tool_m.z(), 0);
}

TEST_F(SceneFile, a_body_has_a_surface_and_layers) {
  EXPECT_EQ(load(kScene).bodies[0].surface, BodySurface::tissue);
  EXPECT_TRUE(load(kScene).bodies[0].layers.empty());
  const std::string contact = "contact: {style: templates}";
  const auto with_layers = [&](const std::string& layers) {
    return contact + "\n    surface: cloth\n    layers: [" + layers + "]";
  };
  const BodySpec body =
      load(with(contact, with_layers("{to_depth_m: 0.002, colour: [1, 0, 0]}, {colour: [0, 1, 0]}"))).bodies[0];
  EXPECT_EQ(body.surface, BodySurface::cloth);
  ASSERT_EQ(body.layers.size(), 2u);
  EXPECT_EQ(body.layers[0].to_depth_m, 0.002);
  EXPECT_EQ(body.layers[1].colour, Vec3(0, 1, 0));
  EXPECT_NE(refusal(contact, with_layers("{colour: [1, 0, 0]}, {colour: [0, 1, 0]}")).find("needs to_depth_m"),
            std::string::npos);
  EXPECT_NE(refusal(contact, with_layers("{to_depth_m: 0.002, colour: [1, 0, 0]}, "
                                         "{to_depth_m: 0.001, colour: [0, 1, 0]}"))
                .find("deeper"),
            std::string::npos);
  EXPECT_NE(refusal(contact, contact + "\n    surface: wood").find("surface"), std::string::npos);
}

TEST_F(SceneFile, an_instrument_has_a_limit_of_its_speed) {
  EXPECT_EQ(load(kScene).tools[0].max_speed_m_per_s, 5);
  const Scene scene = load(with("kind: scalpel", "kind: scalpel, max_speed_m_per_s: 0.4"));
  EXPECT_EQ(scene.tools[0].max_speed_m_per_s, 0.4);
  EXPECT_EQ(scene.tools[1].max_speed_m_per_s, 5);
  EXPECT_EQ(refusal("kind: scalpel", "kind: scalpel, max_speed_m_per_s: 0"),
            "s.yaml:17: tools[0].max_speed_m_per_s: expected in (0, 100], got 0");
}

TEST_F(SceneFile, gravity_turns_by_a_plan) {
  std::string text = kScene;
  const std::string plan =
      "gravity_changes:\n  - {at_s: 1, gravity_m_per_s2: [5, 0, -8]}\n"
      "  - {at_s: 2.5, gravity_m_per_s2: [0, 0, -9]}\ngravity_turns_deg_per_s: 30\n";
  const Scene scene = load(plan + text);
  ASSERT_EQ(scene.gravity_changes.size(), 2u);
  EXPECT_EQ(scene.gravity_changes[1].at_s, 2.5);
  EXPECT_EQ(scene.gravity_changes[0].gravity_m_per_s2, Vec3(5, 0, -8));
  EXPECT_EQ(scene.gravity_turns_deg_per_s, 30);
  EXPECT_EQ(refusal("session: test",
                    "gravity_changes: [{at_s: 2, gravity_m_per_s2: [0, 0, 1]}, {at_s: 1, "
                    "gravity_m_per_s2: [0, 0, 1]}]\nsession: test"),
            "s.yaml:1: gravity_changes[1]: at_s must be later than the one before");
}

TEST_F(SceneFile, a_key_of_one_model_is_refused_for_another) {
  const auto flaw = [&](const std::string& model, const std::string& volume) {
    std::string text = kScene;
    for (const auto& [from, to] : {std::pair<std::string, std::string>{"model: surface_springs", "model: " + model},
                                   {"contact: {style: templates}", "volume: {" + volume + "}"}})
      text.replace(text.find(from), from.size(), to);
    try {
      load(text);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(flaw("neo_hookean", "cell_m: 0.01").find("cell_m: it is for model neo_hookean_lattice only"),
            std::string::npos);
  EXPECT_NE(flaw("neo_hookean_lattice", "damper_s: 0").find("damper_s: it is for model tetra_springs only"),
            std::string::npos);
  EXPECT_EQ(flaw("tetra_springs", "damper_s: 0").find("only"), std::string::npos);
}

TEST_F(SceneFile, what_is_expected_is_a_range_in_words) {
  const Scene scene =
      load(kScene + std::string("expect: {incisions: 1, pieces_freed: at least 2, freed_ml: 2.5 to 3e1, "
                                "refusals: at most 4}\n"));
  ASSERT_EQ(scene.expect.size(), 4u);
  std::vector<std::string> words;
  for (const Expectation& e : scene.expect) words.push_back(e.measure->key + " " + e.range.in_words());
  EXPECT_EQ(words, (std::vector<std::string>{"incisions 1", "pieces_freed at least 2", "freed_ml 2.5 to 30",
                                             "refusals at most 4"}));
  const auto flaw = [&](const std::string& expect) {
    return refusal("session: test", "expect: {" + expect + "}\nsession: test");
  };
  const std::string forms = ", \"at least NUMBER\", \"at most NUMBER\" or \"NUMBER to NUMBER\", got ";
  for (const std::string wrong : {"-1", "at least", "3 to 2", "about 3", "at least -1", "one"})
    EXPECT_EQ(flaw("incisions: " + wrong), "s.yaml:1: expect.incisions: expected a number >= 0" + forms + wrong);
  EXPECT_EQ(flaw("healthy_lost_ml: 1"), "s.yaml:1: expect.healthy_lost_ml: the scene has no exercise");
  EXPECT_EQ(flaw("incision: 1"), "s.yaml:1: expect.incision: unknown key; did you mean incisions?");
}

TEST_F(SceneFile, regions_arrive_and_wrong_ones_are_named) {
  const std::string colours = "    contact: {style: templates}\n";
  const std::string regions =
      "    regions:\n"
      "      - name: tumour\n"
      "        colour: [0.8, 0.7, 0.5]\n"
      "        rim: {width_m: 0.001, colour: [1, 1, 0.5]}\n"
      "        stiffness_factor: 4\n"
      "        marked: true\n"
      "        shapes: [{sphere: {centre_body_m: [1, 2, 3], radius_m: 0.02}},\n"
      "                 {box: {min_body_m: [0, 0, 0], max_body_m: [2, 4, 6]}}]\n"
      "      - name: vein\n"
      "        shapes: [{tube: {points_body_m: [[0, 0, 0], [1, 0, 0], [1, 1, 0]], radii_m: [3, 2, 1]}}]\n";
  std::string text = kScene;
  text.replace(text.find(colours), colours.size(), colours + regions);
  const Regions read = load(text).bodies[0].regions;
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].name, "tumour");
  EXPECT_EQ(read[0].rim_m, 0.001);
  EXPECT_TRUE(read[0].marked);
  EXPECT_EQ(read[0].stiffness_factor, 4);
  ASSERT_EQ(read[0].parts.size(), 2u);
  EXPECT_EQ(read[0].parts[0].b_m, Vec3::Constant(0.02));
  EXPECT_EQ(read[0].parts[1].form, RegionForm::box);
  EXPECT_EQ(read[0].parts[1].a_m, Vec3(1, 2, 3));
  ASSERT_EQ(read[1].parts.size(), 2u);
  EXPECT_EQ(read[1].parts[1].radius_a_m, 2);
  EXPECT_EQ(read[1].parts[1].radius_b_m, 1);

  const auto refused = [&](const std::string& from, const std::string& to) {
    std::string wrong = regions;
    const std::size_t at = wrong.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return refusal(colours, colours + wrong.replace(at, from.size(), to));
  };
  EXPECT_EQ(refused("radii_m: [3, 2, 1]", "radii_m: [3, 2]"),
            "s.yaml:25: bodies[0].regions[1].shapes[0].tube: expected two points or more, and a radius for each");
  EXPECT_EQ(refused("radius_m: 0.02", "radius_m: 0"),
            "s.yaml:22: bodies[0].regions[0].shapes[0].sphere.radius_m: expected in (0, 10], got 0");
  EXPECT_EQ(refused("sphere: {", "cone: {"),
            "s.yaml:22: bodies[0].regions[0].shapes[0].cone: unknown key; known are ellipsoid, sphere, box, tube");
  EXPECT_EQ(refused("name: vein", "name: tumour"), "s.yaml:24: bodies[0].regions[1]: the name tumour is used twice");
  std::string many = "radii_m: [1", points = "points_body_m: [[0, 0, 0]";
  for (int i = 1; i < 32; ++i) many += ", 1", points += ", [0, 0, " + std::to_string(0.1 * i) + "]";
  EXPECT_EQ(
      refused("points_body_m: [[0, 0, 0], [1, 0, 0], [1, 1, 0]], radii_m: [3, 2, 1]", points + "], " + many + "]"),
      "s.yaml:17: bodies[0].regions: 33 ellipsoids, boxes and pieces of tubes; at most 32 can be drawn");
}

TEST_F(SceneFile, an_exercise_names_a_body_with_marked_tissue_and_a_bin) {
  const std::string bin = "bin: {min_world_m: [0, 0, 0], max_world_m: [1, 1, 1]}";
  const auto with = [&](const std::string& exercise, const std::string& marked) {
    std::string text = kScene;
    const std::string regions =
        "    regions: [{name: tumour, " + marked + "shapes: [{sphere: {centre_body_m: [0, 0, 0], radius_m: 1}}]}]\n";
    text.insert(text.find("    contact: {style"), regions);
    return text + "exercise: {" + exercise + "}\n";
  };
  const Scene scene = load(with("body: cube, " + bin, "marked: true, "));
  ASSERT_TRUE(scene.exercise.has_value());
  EXPECT_EQ(scene.exercise->body, "cube");
  EXPECT_EQ(scene.exercise->bin->max_world_m, Vec3(1, 1, 1));
  EXPECT_FALSE(load(kScene).exercise.has_value());
  EXPECT_TRUE(scene.exercise->spare.empty());
  for (const auto& [exercise, marked] : {std::pair<std::string, std::string>("body: sphere, " + bin, "marked: true, "),
                                         {"body: cube, spare: [cube], " + bin, "marked: true, "},
                                         {"body: cube, spare: [nerve], " + bin, "marked: true, "},
                                         {"body: cube, " + bin, ""},
                                         {"body: cube", "marked: true, "}})
    EXPECT_THROW(load(with(exercise, marked)), InputError);
}

TEST_F(SceneFile, forceps_have_a_grip_and_others_do_not) {
  const auto with = [](const std::string& tool) {
    const std::string text = kScene;
    return text.substr(0, text.find("  - {name: knife")) + "  - " + tool + "\n";
  };
  const ToolSpec usual = load(with("{name: f, kind: forceps}")).tools[0];
  EXPECT_FALSE(usual.grip_force_n || usual.grip_radius_m);
  const ToolSpec tool = load(with("{name: f, kind: forceps, grip_force_n: 3, grip_radius_m: 0.01, geometry: "
                                  "{sphere_radius_m: 0.008}}"))
                            .tools[0];
  EXPECT_EQ(tool.grip_force_n, 3);
  EXPECT_EQ(tool.grip_radius_m, 0.01);
  EXPECT_EQ(tool.geometry.sphere_radius_m, 0.008);
  EXPECT_THROW(load(with("{name: p, kind: probe, grip_force_n: 3}")), InputError);
  EXPECT_THROW(load(with("{name: f, kind: forceps, grip_radius_m: 0.01, geometry: {sphere_radius_m: 0.01}}")),
               InputError);
}

TEST_F(SceneFile, a_file_in_metres_centimetres_or_millimetres_arrives_in_metres) {
  for (const auto& [unit, length_m] : {std::pair("unit: m}", 1.0), {"unit: cm}", 0.01}, {"unit: mm}", 0.001}}) {
    std::string text = kScene;
    text.replace(text.find("unit: cm}"), 9, unit);
    const BodySpec body = load(text).bodies[0];
    EXPECT_EQ(body.mesh_unit_m, length_m);
    double largest_m = 0;
    for (const Vec3& x : body.mesh.vertices_body_m) largest_m = std::max(largest_m, x.maxCoeff());
    EXPECT_DOUBLE_EQ(largest_m, length_m);
  }
}

TEST_F(SceneFile, rotation_is_about_the_worlds_x_then_y_then_z_axis) {
  std::string text = kScene;
  text.replace(text.find("[0, 0, 90]"), 10, "[90, 0, 90]");
  const Pose pose = load(text).bodies[0].pose;
  EXPECT_TRUE((pose.orientation * Vec3::UnitY()).isApprox(Vec3::UnitZ(), 1e-12));
  EXPECT_TRUE((pose.orientation * Vec3::UnitX()).isApprox(Vec3::UnitY(), 1e-12));
}

TEST_F(SceneFile, threshold_by_displacement_replaces_the_default_force) {
  std::string text = kScene;
  text.replace(text.find("threshold_force_n: 0.3"), 22, "threshold_displacement_m: 0.002");
  const CuttingSpec cutting = load(text).bodies[0].cutting;
  EXPECT_FALSE(cutting.threshold_force_n.has_value());
  EXPECT_EQ(cutting.threshold_displacement_m, 0.002);
}

TEST_F(SceneFile, a_tab_that_indents_is_named) {
  EXPECT_EQ(refusal("    model:", "\t    model:"), "s.yaml:10: a tab indents this line; YAML takes spaces alone");
}

TEST_F(SceneFile, wrong_values_are_named_with_line_and_key) {
  EXPECT_EQ(refusal("young_pa: 7000", "young_pa: -5"), "s.yaml:11: bodies[0].material.young_pa: expected > 0, got -5");
  EXPECT_EQ(refusal("poisson: 0.4", "poisson: 0.5"),
            "s.yaml:11: bodies[0].material.poisson: expected in [0, 0.5), got 0.5");
  EXPECT_EQ(refusal("step_s: 0.002", "step_s: fast"), "s.yaml:2: step_s: expected a finite number, got fast");
  EXPECT_EQ(refusal("step_s: 0.002", "step_s: 1e-300"), "s.yaml:2: step_s: expected in [1e-06, 0.0334], got 1e-300");
  for (const char* bad : {".nan", "nan", ".inf", "1e999", "\"1\"", "1,5", "0x10", "", "[1]", "{a: 1}", "1 2", "~"}) {
    const std::string message = refusal("step_s: 0.002", std::string("step_s: ") + bad);
    EXPECT_EQ(message.rfind("s.yaml:", 0), 0u) << bad << message;
    EXPECT_NE(message.find(": step_s: expected a finite number"), std::string::npos) << bad << message;
  }
  EXPECT_EQ(refusal("[0, 0, -1]", "[0, 0]"),
            "s.yaml:4: gravity_m_per_s2: expected three numbers [x, y, z], got a list of 2");
  EXPECT_EQ(refusal("[0, 0, -1]", "[0, zero, -1]"),
            "s.yaml:4: gravity_m_per_s2[1]: expected a finite number, got zero");
  EXPECT_EQ(refusal("unit: cm", "unit: inch"), "s.yaml:8: bodies[0].mesh.unit: expected one of m, cm, mm, got inch");
  EXPECT_EQ(refusal("model: surface_springs", "model: tetra_springs"),
            "s.yaml:15: bodies[0].contact: templates divide a surface: they need the model surface_springs");
  EXPECT_EQ(refusal("style: templates", "style: glue"),
            "s.yaml:15: bodies[0].contact.style: expected one of vertices, templates, got glue");
  const std::string semi = refusal("hysteresis: 0.5", "hysteresis: 0.5, style: semi_progressive");
  EXPECT_NE(semi.find("cutting: semi_progressive cuts tetrahedra: it needs a model with a volume"), std::string::npos)
      << semi;
  const std::string snap = refusal("hysteresis: 0.5", "hysteresis: 0.5, snap_ratio: 0.1");
  EXPECT_NE(snap.find("cutting: snap_ratio is of tetrahedra: it needs a model with a volume"), std::string::npos)
      << snap;
  EXPECT_EQ(refusal("hysteresis: 0.5", "snap_ratio: 0.3"),
            "s.yaml:12: bodies[0].cutting.snap_ratio: expected in [0.02, 0.15], got 0.3");
  EXPECT_EQ(refusal("model: surface_springs", "model: jelly"),
            "s.yaml:10: bodies[0].model: expected one of surface_springs, tetra_springs, neo_hookean, "
            "neo_hookean_lattice, auto, got jelly");
  EXPECT_EQ(refusal("[1, 0, 0], wall", "[1, 0, 255], wall"),
            "s.yaml:14: bodies[0].colours.skin[2]: expected in [0, 1], got 255");
  EXPECT_EQ(refusal("hysteresis: 0.5", "loops_free_islands: 1"),
            "s.yaml:12: bodies[0].cutting.loops_free_islands: expected true or false, got 1");
}

TEST_F(SceneFile, budgets_are_of_model_auto_which_chooses_the_rest) {
  std::string text = kScene;
  const std::string model = "model: surface_springs", step = "step_s: 0.002";
  text.replace(text.find(step), step.size(), "step_s: auto");
  text.replace(text.find(model), model.size(), "model: auto\n    error_budget: 0.03\n    cpu_budget: 0.2");
  const Scene scene = load(text);
  EXPECT_TRUE(scene.step_is_free);
  EXPECT_EQ(scene.bodies[0].model, "auto");
  EXPECT_EQ(scene.bodies[0].plan.error_budget, 0.03);
  EXPECT_EQ(scene.bodies[0].plan.cpu_budget, 0.2);
  EXPECT_EQ(refusal(model, "model: auto\n    error_budget: 0"),
            "s.yaml:11: bodies[0].error_budget: expected in (0, 10], got 0");
  EXPECT_EQ(refusal(model, "model: auto\n    cpu_budget: -1"),
            "s.yaml:11: bodies[0].cpu_budget: expected in (0, 1000], got -1");
  EXPECT_EQ(refusal(model, model + "\n    error_budget: 0.1"),
            "s.yaml:11: bodies[0].error_budget: it is of model auto");
  EXPECT_EQ(refusal(model, "model: auto\n    volume: {cell_m: 0.01}"),
            "s.yaml:11: bodies[0].volume.cell_m: model auto chooses it");
  EXPECT_EQ(refusal(step, "step_s: auto"), "") << "with any model";
}

TEST_F(SceneFile, unknown_keys_are_errors_with_the_nearest_known) {
  EXPECT_EQ(refusal("poisson: 0.4", "poison: 0.4"),
            "s.yaml:11: bodies[0].material.poison: unknown key; did you mean poisson?");
  EXPECT_EQ(refusal("step_s", "step_ms"), "s.yaml:2: step_ms: unknown key; did you mean step_s?");
  EXPECT_EQ(refusal("step_s: 0.002", "xyzzy_plugh: 1").substr(0, 43), "s.yaml:2: xyzzy_plugh: unknown key; known a");
  EXPECT_EQ(refusal("unit: cm", "unit: cm, files: x"),
            "s.yaml:8: bodies[0].mesh.files: unknown key; did you mean file?");
  EXPECT_EQ(refusal("intensity: 0.5", "intensty: 0.5"),
            "s.yaml:18: tools[1].intensty: unknown key; did you mean intensity?");
}

TEST_F(SceneFile, keys_of_other_kinds_of_instruments_are_unknown) {
  const std::string hook = "intensity: 0.5", kind = "kind: cautery_hook";
  EXPECT_EQ(refusal(kind, "kind: probe").substr(0, 37), "s.yaml:18: tools[1].intensity: unknow");
  for (const std::string key : {"sharp_length_m", "gauge_m"})
    EXPECT_NE(refusal(hook, "geometry: {" + key + ": 0.01}").find("tools[1].geometry." + key + ": unknown key"),
              std::string::npos);
}

TEST_F(SceneFile, a_key_without_a_value_is_told_at_its_line) {
  EXPECT_EQ(refusal("duration_s: 3", "duration_s:"), "s.yaml:3: duration_s: expected a finite number, got nothing");
}

TEST_F(SceneFile, missing_and_duplicate_keys_are_errors) {
  EXPECT_EQ(refusal("session: test", "sesion: test"), "s.yaml:1: session: missing; is \"sesion\" meant to be it?");
  EXPECT_EQ(refusal("    mesh: {file: cube.obj, unit: cm}\n", ""), "s.yaml:7: bodies[0].mesh: missing");
  EXPECT_EQ(refusal(", unit: cm", ""), "s.yaml:8: bodies[0].mesh.unit: missing");
  EXPECT_EQ(refusal("duration_s: 3", "step_s: 3"), "s.yaml:3: step_s: the key stands here for the second time");
  EXPECT_EQ(refusal(", max_world_m: [1, 1, 1]", ""), "s.yaml:13: bodies[0].fixed.max_world_m: missing");
}

TEST_F(SceneFile, lists_and_names) {
  const std::string text = kScene;
  const std::string bodies = text.substr(text.find("bodies:"), text.find("tools:") - text.find("bodies:"));
  EXPECT_EQ(refusal(bodies, "bodies: []\n"), "s.yaml:6: bodies: expected at least one entry, the list is empty");
  EXPECT_EQ(refusal(bodies, "bodies: cube\n"), "s.yaml:6: bodies: expected a list, got cube");
  EXPECT_EQ(refusal(bodies, "bodies: [cube]\n"), "s.yaml:6: bodies[0]: expected keys with values, got cube");
  EXPECT_EQ(refusal("name: hook", "name: knife"), "s.yaml:18: tools[1]: the name knife is used twice");
  EXPECT_EQ(refusal("session: test", "session: a/b").substr(0, 18), "s.yaml:1: session:");
  EXPECT_EQ(
      refusal("name: cube", "name: Säule"),
      "s.yaml:7: bodies[0].name: expected a name of at most 64 letters without accents, digits, _, - and ., got Säule");
  EXPECT_EQ(refusal("session: test", "session: \"\""), "s.yaml:1: session: expected a text, got \"\"");
}

TEST_F(SceneFile, files_are_named_where_they_are_asked_for) {
  EXPECT_EQ(refusal("cube.obj", "absent.obj"), "s.yaml:8: bodies[0].mesh.file: absent.obj: no such file");
  EXPECT_EQ(refusal("knife.csv", "absent.csv").substr(0, 35), "s.yaml:17: tools[0].trace: absent.c");
  std::ofstream(folder_ / "knife.csv") << "time_s\n";
  EXPECT_EQ(refusal("hysteresis: 0.5", "hysteresis: 0.6").substr(0, 26), "s.yaml:17: tools[0].trace:");
}

TEST_F(SceneFile, sizes_and_shapes_that_make_no_sense_are_refused) {
  write("cube.obj", "v 0 0 0\nv 900 0 0\nv 0 900 0\nv 0 0 900\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  EXPECT_NE(refusal("hysteresis: 0.5", "hysteresis: 0.6").find("s.yaml:8: bodies[0].mesh.unit: the mesh would be 15"),
            std::string::npos);
  EXPECT_NE(refusal("max_world_m: [1, 1, 1]", "max_world_m: [1, -1, 1]").find("bodies[0].fixed: each number"),
            std::string::npos);
  EXPECT_NE(refusal("eye_world_m: [0, -1, 1]", "eye_world_m: [0, 0, 1]").find("camera: up_world points along the view"),
            std::string::npos);
  EXPECT_NE(refusal("hysteresis: 0.5", "threshold_displacement_m: 1").find("not both"), std::string::npos);
  EXPECT_NE(refusal("kind: scalpel", "kind: scalpel, geometry: {c_tool_m: [0, 0, 0.01]}").find("no direction"),
            std::string::npos);
}

TEST_F(SceneFile, text_that_is_no_scene_is_refused) {
  for (const std::string& text :
       {std::string(), std::string("just text"), std::string("[1, 2"), std::string("a: b: c"),
        std::string("session: x\n---\nsession: y\n"), std::string("&a [*a]"), std::string(100'000, '['),
        std::string("\xff\xfe\x00\x01", 4), std::string("? {a: b}\n: c\n"),
        std::string("session: !!binary x\nbodies: &b [*b]\n")}) {
    EXPECT_THROW(load(text), InputError) << text.substr(0, 40);
  }
}

TEST_F(SceneFile, a_second_document_is_named_with_its_line) {
  EXPECT_EQ(refusal("bodies:\n", "---\nbodies:\n"), "s.yaml:6: a second document begins; expected one");
}

TEST_F(SceneFile, a_file_that_is_not_there_is_not_called_empty) {
  write("empty.yaml", "");
  write("comment.yaml", "# later\n");
  const std::string folder = folder_.string();
  for (const auto& [path, flaw] :
       std::map<std::string, std::string>{{folder + "/absent.yaml", "can't be read: No such file or directory"},
                                          {folder, "can't be read: Is a directory"},
                                          {folder + "/empty.yaml", "the file is empty"},
                                          {"/dev/zero", "more than 4 MB"},
                                          {folder + "/comment.yaml", "nothing in this file but comments"}}) {
    try {
      load_scene(path, standard_traits());
      ADD_FAILURE() << path << " was read";
    } catch (const InputError& error) {
      EXPECT_EQ(error.what(), path + ": " + flaw);
    }
  }
}

TEST_F(SceneFile, damaged_text_is_read_or_refused_and_nothing_else) {
  test::Random random(7);
  const std::string good = kScene;
  int refused = 0;
  for (int i = 0; i < 400; ++i) {
    std::string text = good;
    for (unsigned k = 1 + random() % 4; k > 0; --k) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, 1 + random() % 30);
          break;
        case 2:
          text.insert(at, 1, "{}[]:,&*!|>#'\"%@`?-~\n\t"[random() % 23]);
          break;
        default:
          text.insert(at, text.substr(random() % text.size(), random() % 60));
      }
    }
    try {
      load(text);
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 200);
}

TEST(Scenes, scenes_of_the_project_load_and_their_traces_begin_and_end_clear_of_every_body) {
  int count = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(fs::path(SECTIO_SOURCE_DIR) / "deploy" / "scenes")) {
    if (entry.path().extension() != ".yaml") continue;
    ++count;
    const Scene scene = load_scene(entry.path().string(), standard_traits());
    for (const ToolSpec& tool : scene.tools) {
      ASSERT_GT(tool.trace.size(), 1u) << entry.path();
      EXPECT_LE(tool.trace.back().time_s, scene.duration_s) << entry.path();
      for (const TracePoint& point : {tool.trace.front(), tool.trace.back()})
        for (const BodySpec& body : scene.bodies) {
          double nearest_m = 1;
          for (const Vec3& p : body.mesh.vertices_body_m)
            nearest_m = std::min(nearest_m, (body.pose.to_world(p) - point.pose_world.position_m).norm());
          EXPECT_GT(nearest_m, 0.015) << entry.path() << ", " << tool.name << ", " << body.name;
        }
    }
  }
  EXPECT_EQ(count, 54) << "a scene that is added is counted here, so that none is left out";
}

}  // namespace
}  // namespace sectio::scene_test
