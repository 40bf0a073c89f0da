#include "sim_server/scene/schema.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "sim_server/scene/scene.h"

namespace sectio {
namespace {

using Json = nlohmann::ordered_json;

const char* const kRangePattern = "^(at least|at most|[0-9.eE+-]+ to) [0-9.eE+-]+$";

Json to_json(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

Json number_in(const Range& range) {
  Json number{{"type", "number"}};
  if (std::isfinite(range.low)) number[range.low_allowed ? "minimum" : "exclusiveMinimum"] = range.low;
  if (std::isfinite(range.high)) number[range.high_allowed ? "maximum" : "exclusiveMaximum"] = range.high;
  return number;
}

Json map_of(const std::vector<Key>& keys);

Json value_of_type(KeyType type, const Key& key) {
  switch (type) {
    case KeyType::number:
      if (key.words.empty()) return number_in(key.range);
      return {{"anyOf", Json::array({number_in(key.range), Json{{"enum", key.words}}})}};
    case KeyType::boolean:
      return {{"type", "boolean"}};
    case KeyType::vector:
      return {{"type", "array"}, {"items", number_in(key.range)}, {"minItems", 3}, {"maxItems", 3}};
    case KeyType::text:
      return {{"type", "string"}, {"minLength", 1}};
    case KeyType::name:
      return {{"type", "string"}, {"pattern", "^[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}$"}};
    case KeyType::choice:
      return {{"enum", key.words}};
    case KeyType::range:
      return {{"anyOf", Json::array({number_in(key.range), Json{{"type", "string"}, {"pattern", kRangePattern}}})}};
    case KeyType::map:
      return map_of(key.keys);
    case KeyType::list:
      break;
  }
  return {{"type", "array"}, {"items", value_of_type(key.entries, key)}, {"minItems", 1}};
}

void add_default(Json& value, const KeyValue& usual) {
  if (const auto* flag = std::get_if<bool>(&usual)) value["default"] = *flag;
  if (const auto* number = std::get_if<double>(&usual)) value["default"] = *number;
  if (const auto* vector = std::get_if<Vec3>(&usual)) value["default"] = to_json(*vector);
  if (const auto* text = std::get_if<std::string>(&usual)) value["default"] = *text;
}

Json map_of(const std::vector<Key>& keys) {
  Json map{{"type", "object"}, {"properties", Json::object()}};
  Json required = Json::array();
  for (const Key& key : keys) {
    Json value = value_of_type(key.type, key);
    const std::string unit = unit_of(key.name);
    value["description"] = key.meaning + (unit.empty() ? "" : " Unit: " + unit + ".");
    add_default(value, key.default_value);
    map["properties"][key.name] = std::move(value);
    if (key.required) required.push_back(key.name);
  }
  if (!required.empty()) map["required"] = required;
  map["additionalProperties"] = false;
  return map;
}

}  // namespace

std::string scene_schema(const EngineTraits& traits) {
  Json schema{{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", "A scene of Sectio"}};
  schema.update(map_of(describe_scene(traits)));
  return schema.dump(1) + "\n";
}

}  // namespace sectio
