// Models and processes that the scene room has never heard of, with keys of their own.
#include "tests/unit/scene/scene_file.h"

namespace sectio::scene_test {
namespace {

class EngineKeys : public test::SceneFile {
 protected:
  EngineKeys() {
    traits_.models.push_back(
        {.name = "jelly",
         .meaning = "Wobbles.",
         .needs_volume = true,
         .can_cut = false,
         .keys = {{.name = "wobble_hz", .meaning = "How fast.", .default_value = 3.0, .range = above_to(0, 10)},
                  {.name = "flavour",
                   .type = KeyType::choice,
                   .meaning = "Which.",
                   .words = {"lemon", "cherry"},
                   .required = true},
                  {.name = "sparkles", .type = KeyType::boolean, .meaning = "Whether."}}});
    traits_.models.push_back({.name = "clay",
                              .meaning = "Stays as it is.",
                              .keys = {{.name = "wobble_hz", .meaning = "How fast clay does.", .default_value = 7.0}}});
    traits_.processes = {{.kind = "leak",
                          .meaning = "Flows from one to the other.",
                          .fewest_bodies = 2,
                          .most_bodies = 2,
                          .keys = {{.name = "flow_m3_per_s", .meaning = "How much.", .default_value = 1e-6}}},
                         {.kind = "warmth", .meaning = "Is warm.", .most_bodies = 9}};
  }

  std::string with_processes(const std::string& entry) const { return "processes: [" + entry + "]\nsession: test"; }
  static std::string model(const std::string& name) { return "model: " + name; }
};

const std::string kModel = "model: surface_springs";
const std::string kContact = "    contact: {style: templates}\n",
                  kCutting = "    cutting: {threshold_force_n: 0.3, hysteresis: 0.5}\n";

TEST_F(EngineKeys, a_models_own_keys_arrive_with_their_defaults) {
  std::string text = with(kModel, "model: jelly\n    flavour: lemon");
  text.replace(text.find(kContact), kContact.size(), "");
  text.replace(text.find(kCutting), kCutting.size(), "");
  const Options options = load(text).bodies[0].options;
  EXPECT_EQ(options.number("wobble_hz"), 3);
  EXPECT_EQ(options.text("flavour"), "lemon");
  EXPECT_FALSE(options.has("sparkles")) << "no default, not given";
  EXPECT_TRUE(load(test::kScene).bodies[0].options.values.empty());
  std::string clay = with(kModel, "model: clay\n    wobble_hz: 2");
  EXPECT_EQ(load(clay.replace(clay.find(kContact), kContact.size(), "")).bodies[0].options.number("wobble_hz"), 2);
}

TEST_F(EngineKeys, wrong_ones_are_named_with_line_and_key) {
  EXPECT_EQ(refusal(kModel, "model: jelly\n    flavour: mud"),
            "s.yaml:11: bodies[0].flavour: expected one of lemon, cherry, got mud");
  EXPECT_EQ(refusal(kModel, model("jelly")), "s.yaml:7: bodies[0].flavour: missing");
  EXPECT_EQ(refusal(kModel, "model: jelly\n    flavour: lemon\n    wobble_hz: 11"),
            "s.yaml:12: bodies[0].wobble_hz: expected in (0, 10], got 11");
  EXPECT_EQ(refusal(kModel, kModel + "\n    flavour: lemon"), "s.yaml:11: bodies[0].flavour: it is of model jelly");
  EXPECT_EQ(refusal(kModel, model("marble")),
            "s.yaml:10: bodies[0].model: expected one of surface_springs, tetra_springs, neo_hookean, "
            "neo_hookean_lattice, jelly, clay, auto, got marble");
}

TEST_F(EngineKeys, what_a_model_may_have_is_asked_of_it) {
  const std::string jelly = "model: jelly\n    flavour: lemon", clay = model("clay");
  EXPECT_EQ(refusal(kModel, clay),
            "s.yaml:15: bodies[0].contact: templates divide a surface: they need the model surface_springs");
  for (ModelTraits& model : traits_.models) model.accepts_templates = true;
  EXPECT_EQ(refusal(kModel, clay), "");
  EXPECT_EQ(refusal(kModel, clay + "\n    volume: {tetrahedra: 100}"),
            "s.yaml:11: bodies[0].volume: the model clay has no volume");
  EXPECT_EQ(refusal(kModel, jelly), "s.yaml:13: bodies[0].cutting: the model jelly can't be cut");
}

TEST_F(EngineKeys, processes_are_read_by_their_kind) {
  const Scene scene = load(with("session: test", with_processes("{name: warm, kind: warmth, bodies: [cube]}")));
  ASSERT_EQ(scene.processes.size(), 1u);
  EXPECT_EQ(scene.processes[0].name, "warm");
  EXPECT_EQ(scene.processes[0].kind, "warmth");
  EXPECT_EQ(scene.processes[0].bodies, std::vector<std::string>{"cube"});
  const auto refused = [&](const std::string& entry) { return refusal("session: test", with_processes(entry)); };
  EXPECT_EQ(refused("{name: a, kind: leak, bodies: [cube]}"),
            "s.yaml:1: processes[0].bodies: leak takes 2 to 2 bodies, got 1");
  EXPECT_EQ(refused("{name: a, kind: warmth, bodies: [cube, cube]}"),
            "s.yaml:1: processes[0].bodies: the body cube stands twice");
  EXPECT_EQ(refused("{name: a, kind: warmth, bodies: [ball]}"), "s.yaml:1: processes[0].bodies: there is no body ball");
  EXPECT_EQ(refused("{name: a, kind: warmth, bodies: [cube], flow_m3_per_s: 1}"),
            "s.yaml:1: processes[0].flow_m3_per_s: it is of kind leak");
  EXPECT_EQ(refused("{name: a, kind: cold, bodies: [cube]}"),
            "s.yaml:1: processes[0].kind: expected one of leak, warmth, got cold");
  traits_.processes.clear();
  EXPECT_NE(refused("{name: a, kind: warmth, bodies: [cube]}").find("processes: unknown key"), std::string::npos);
}

}  // namespace
}  // namespace sectio::scene_test
