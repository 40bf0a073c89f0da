// The program's schema and manual are those of the repository, and the scenes keep to them.
#include "sim_server/scene/schema.h"
#include "sim_server/engine/standard_traits.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "sim_server/scene/scene.h"

namespace sectio::scene_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const fs::path kRoot = SECTIO_SOURCE_DIR;

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<fs::path> scenes() {
  std::vector<fs::path> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(kRoot / "deploy" / "scenes"))
    if (entry.path().extension() == ".yaml") found.push_back(entry.path());
  return found;
}

json as_json(const YAML::Node& node) {
  if (node.IsMap()) {
    json map = json::object();
    for (const auto& entry : node) map[entry.first.Scalar()] = as_json(entry.second);
    return map;
  }
  if (node.IsSequence()) {
    json list = json::array();
    for (const auto& entry : node) list.push_back(as_json(entry));
    return list;
  }
  const std::string& word = node.Scalar();
  if (word == "true" || word == "false") return word == "true";
  char* end = nullptr;
  const double x = std::strtod(word.c_str(), &end);
  return *end == 0 && !word.empty() ? json(x) : json(word);
}

// The first place where a value breaks a schema, of the words that scene_schema() uses; "" when it keeps to it.
std::string flaw(const json& schema, const json& value, const std::string& path = "") {
  if (schema.contains("anyOf")) {
    for (const json& one : schema["anyOf"])
      if (flaw(one, value, path).empty()) return "";
    return path + ": none of anyOf";
  }
  if (schema.contains("enum"))
    return std::ranges::find(schema["enum"], value) != schema["enum"].end() ? "" : path + ": not one of the words";
  const std::string type = schema["type"];
  if (type == "object") {
    if (!value.is_object()) return path + ": no map";
    for (const json& key : schema.value("required", json::array()))
      if (!value.contains(key.get<std::string>())) return path + "." + key.get<std::string>() + ": missing";
    for (const auto& [key, entry] : value.items()) {
      if (!schema["properties"].contains(key)) return path + "." + key + ": unknown";
      if (std::string wrong = flaw(schema["properties"][key], entry, path + "." + key); !wrong.empty()) return wrong;
    }
    return "";
  }
  if (type == "array") {
    if (!value.is_array()) return path + ": no list";
    if (value.size() < schema.value("minItems", 0u) || value.size() > schema.value("maxItems", 1000u))
      return path + ": too few or too many";
    for (const json& entry : value)
      if (std::string wrong = flaw(schema["items"], entry, path + "[]"); !wrong.empty()) return wrong;
    return "";
  }
  if (type == "boolean") return value.is_boolean() ? "" : path + ": no boolean";
  if (type == "string") {
    if (!value.is_string()) return path + ": no text";
    const std::regex pattern(schema.value("pattern", std::string(".*")));
    return std::regex_match(value.get<std::string>(), pattern) ? "" : path + ": wrong letters";
  }
  if (type != "number") return path + ": the schema has the type " + type;
  if (!value.is_number()) return path + ": no number";
  const double x = value;
  const bool good = x >= schema.value("minimum", -HUGE_VAL) && x > schema.value("exclusiveMinimum", -HUGE_VAL) &&
                    x <= schema.value("maximum", HUGE_VAL) && x < schema.value("exclusiveMaximum", HUGE_VAL);
  return good ? "" : path + ": out of range";
}

TEST(Schema, the_repository_holds_what_the_program_prints) {
  EXPECT_EQ(text_of(kRoot / "deploy/scenes/scene.schema.json"), scene_schema(standard_traits()))
      << "make it again: sim_server schema > deploy/scenes/scene.schema.json";
  EXPECT_EQ(text_of(kRoot / "docs/scene.md"), scene_manual(standard_traits()))
      << "make it again: sim_server schema --manual > docs/scene.md";
}

TEST(Schema, every_scene_names_it_first_and_then_says_what_it_shows) {
  ASSERT_GE(scenes().size(), 27u);
  for (const fs::path& path : scenes()) {
    std::ifstream file(path);
    std::string first, second;
    std::getline(file, first);
    std::getline(file, second);
    EXPECT_EQ(first, "# yaml-language-server: $schema=scene.schema.json") << path;
    EXPECT_TRUE(second.starts_with("# ") && second.size() > 30) << path << second;
  }
}

TEST(Schema, every_scene_says_what_it_is_about) {
  for (const fs::path& path : scenes()) EXPECT_TRUE(YAML::LoadFile(path)["expect"].IsMap()) << path;
}

TEST(Schema, every_scene_keeps_to_it) {
  const json schema = json::parse(scene_schema(standard_traits()));
  for (const fs::path& path : scenes()) EXPECT_EQ(flaw(schema, as_json(YAML::LoadFile(path))), "") << path;
}

TEST(Schema, it_refuses_what_the_reader_refuses) {
  const json schema = json::parse(scene_schema(standard_traits()));
  const std::string good =
      "session: s\nstep_s: auto\nbodies: [{name: b, mesh: {file: b.obj, unit: m}, model: auto, "
      "material: {poisson: 0.4}}]\n";
  ASSERT_EQ(flaw(schema, as_json(YAML::Load(good))), "");
  const std::pair<const char*, const char*> changes[] = {
      {"poisson: 0.4", "poisson: 0.5"},
      {"poisson: 0.4", "poison: 0.4"},
      {"unit: m", "unit: inch"},
      {"step_s: auto", "step_s: soon"},
      {"step_s: auto", "step_s: 0"},
      {"session: s", "session: a/b"},
      {"session: s\n", ""},
      {"unit: m", "file: b"},
      {"name: b", "name: [b]"},
      {"poisson: 0.4", "young_pa: {}"},
      {"model: auto", "model: mud"},
      {"poisson: 0.4", "poisson: yes"},
  };
  for (const auto& [from, to] : changes) {
    std::string text = good;
    text.replace(text.find(from), std::string(from).size(), to);
    EXPECT_NE(flaw(schema, as_json(YAML::Load(text))), "") << to;
  }
}

TEST(Schema, every_key_has_a_meaning_and_what_it_is) {
  const auto look = [](const auto& self, const std::vector<Key>& keys) -> std::size_t {
    std::size_t count = keys.size();
    for (const Key& key : keys) {
      EXPECT_TRUE(key.meaning.ends_with(".")) << key.name << ": " << key.meaning;
      EXPECT_FALSE(key.required && !std::holds_alternative<std::monostate>(key.default_value)) << key.name;
      const bool has_parts = key.type == KeyType::map || (key.type == KeyType::list && key.entries == KeyType::map);
      EXPECT_EQ(!key.keys.empty(), has_parts) << key.name;
      count += self(self, key.keys);
    }
    return count;
  };
  EXPECT_GT(look(look, describe_scene(standard_traits())), 100u);
}

TEST(Schema, units_come_from_names) {
  EXPECT_EQ(unit_of("density_kg_per_m3"), "kg/m³");
  EXPECT_EQ(unit_of("gravity_m_per_s2"), "m/s²");
  EXPECT_EQ(unit_of("damping_per_s"), "1/s");
  EXPECT_EQ(unit_of("viscosity_pa_s"), "Pa·s");
  EXPECT_EQ(unit_of("eye_world_m"), "m");
  EXPECT_EQ(unit_of("poisson"), "");
  EXPECT_EQ(unit_of("m"), "");
}

}  // namespace
}  // namespace sectio::scene_test
