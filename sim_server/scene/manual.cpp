#include <algorithm>
#include <cstdio>

#include "common/core/formatted.h"
#include "common/core/joined.h"
#include "sim_server/instruments/instrument.h"
#include "sim_server/scene/scene.h"
#include "sim_server/scene/schema.h"
#include "sim_server/scene/yaml_value.h"

namespace sectio {
namespace {

const char* const kIntroduction = R"(# The scene file

A scene is a YAML file: the tissue, the instruments, and the world around them. This page is written by
`sim_server schema --manual` from the program's own reader, and a test holds it against that reader.

* The first line `# yaml-language-server: $schema=scene.schema.json` lets an editor complete keys and show what they mean;
  `sim_server schema` prints that file (JSON Schema).
* Names of keys end with their unit. Vectors are `[x, y, z]`; *world* and *body* (the frame of the mesh) say in which frame.
* Files are named relative to the scene's own folder.
* An error is one line, `FILE:LINE: KEY: expected ..., got ...`: unknown, double and missing keys, empty lists,
  wrong types, numbers that are not finite or out of range.
* A range is a number, `at least 2`, `at most 2` or `2 to 3`, ends included.
* Keys in **bold** are required wherever the map or list around them is given; all others have a default or may be absent.
)";

std::string number(double x) {
  return formatted("%.6g", x);
}

std::string vector(const Vec3& v) {
  return formatted("[%.6g, %.6g, %.6g]", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);  // no -0
}

std::string type_of(const Key& key) {
  switch (key.type) {
    case KeyType::number:
      return key.words.empty() ? "number" : "number or " + joined(key.words);
    case KeyType::boolean:
      return "true or false";
    case KeyType::vector:
      return "vector";
    case KeyType::text:
      return "text";
    case KeyType::name:
      return "name";
    case KeyType::choice:
      return joined(key.words);
    case KeyType::range:
      return "range";
    case KeyType::map:
      return "map, see below";
    case KeyType::list:
      break;
  }
  return key.entries == KeyType::map      ? "list of maps, see below"
         : key.entries == KeyType::number ? "list of numbers"
         : key.entries == KeyType::vector ? "list of vectors"
                                          : "list of names";
}

std::string default_of(const Key& key) {
  if (!key.default_note.empty()) return key.default_note;
  if (const auto* flag = std::get_if<bool>(&key.default_value)) return *flag ? "true" : "false";
  if (const auto* x = std::get_if<double>(&key.default_value)) return number(*x);
  if (const auto* v = std::get_if<Vec3>(&key.default_value)) return vector(*v);
  if (const auto* text = std::get_if<std::string>(&key.default_value)) return *text;
  return "";
}

void write_table(const std::string& path, const std::vector<Key>& keys, std::string& page) {
  if (!path.empty()) page += "\n## `" + path + "`\n";
  page += "\n| key | type | unit | range | default | meaning |\n|---|---|---|---|---|---|\n";
  for (const Key& key : keys) {
    const std::string mark = key.required ? "**" : "";
    page += "| " + mark + "`" + key.name + "`" + mark + " | " + type_of(key) + " | " + unit_of(key.name) + " | " +
            (key.range.is_bounded() ? key.range.text() : "") + " | " + default_of(key) + " | " + key.meaning + " |\n";
  }
  for (const Key& key : keys) {
    if (key.keys.empty()) continue;
    const std::string entry = key.type == KeyType::list ? "[]" : "";
    write_table((path.empty() ? "" : path + ".") + key.name + entry, key.keys, page);
  }
}

void write_models(const EngineTraits& traits, std::string& page) {
  page += "\n## Models\n\n| `model` | what it is | volume | can be cut | templates |\n|---|---|---|---|---|\n";
  const auto yes = [](bool is) { return is ? "yes" : "no"; };
  for (const ModelTraits& m : traits.models)
    page += "| `" + m.name + "` | " + m.meaning + " | " + yes(m.needs_volume) + " | " + yes(m.can_cut) + " | " +
            yes(m.accepts_templates) + " |\n";
}

void write_processes(const EngineTraits& traits, std::string& page) {
  if (traits.processes.empty()) return;
  page += "\n## Processes\n\n| `kind` | what goes on | bodies |\n|---|---|---|\n";
  for (const ProcessTraits& p : traits.processes)
    page += "| `" + p.kind + "` | " + p.meaning + " | " + std::to_string(p.fewest_bodies) + " to " +
            std::to_string(p.most_bodies) + " |\n";
}

void write_instruments(std::string& page) {
  page += "\n## Instruments\n\nThe usual geometry of each kind, in metres.\n\n";
  page +=
      "| `kind` | `a_tool_m` | `b_tool_m` | `c_tool_m` | `d_tool_m` | `sharp_length_m` | `gauge_m` | "
      "`sphere_radius_m` | `grip_force_n` | `grip_radius_m` |\n|---|---|---|---|---|---|---|---|---|---|\n";
  for (const std::string& name : instrument_kinds()) {
    const InstrumentKind& kind = instrument_of(name);
    const ToolGeometry& g = kind.geometry;
    page += "| `" + name + "`";
    for (const Vec3& point : {g.a_tool_m, g.b_tool_m, g.c_tool_m, g.d_tool_m}) page += " | " + vector(point);
    for (const double x : {g.sharp_length_m, g.gauge_m, g.sphere_radius_m, kind.grip_force_n, kind.grip_radius_m})
      page += " | " + (x > 0 ? number(x) : "");
    page += " |\n";
  }
}

}  // namespace

std::string scene_manual(const EngineTraits& traits) {
  std::string page = kIntroduction;
  write_table("", describe_scene(traits), page);
  write_models(traits, page);
  write_processes(traits, page);
  write_instruments(page);
  return page;
}

}  // namespace sectio
