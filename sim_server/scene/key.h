// The contents of a scene file as plain data: one description for each key. The key is read by it (key_reader.h), and
// docs/scene.md and the JSON Schema for editors are written from it (schema.h).
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "common/math/types.h"

namespace sectio {

struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_allowed = true;
  bool high_allowed = true;

  bool contains(double x) const;
  bool is_bounded() const;
  std::string text() const;      // "> 0", "in [0, 0.5)"
  std::string in_words() const;  // KeyType::range in words, ends included: "2", "at least 2", "at most 2", "2 to 3"
};
Range above(double low);
Range at_least(double low);
Range between(double low, double high);        // ends included
Range from_to_below(double low, double high);  // high excluded
Range above_to(double low, double high);       // low excluded

enum class KeyType : std::uint8_t {
  number,
  boolean,
  vector,  // three numbers
  text,    // one line, not empty
  name,    // safe in topic partitions and file names: at most 64 letters, digits, _, - and .
  choice,  // one of some words
  range,   // "2", "at least 2", "at most 2" or "2 to 3", ends included
  map,
  list,  // not empty
};

// std::monostate: no value.
using KeyValue = std::variant<std::monostate, bool, double, Vec3, std::string>;

struct Key {
  std::string name;  // ends with its unit, if it has one: see unit_of()
  KeyType type = KeyType::number;
  std::string meaning;  // one plain sentence
  KeyValue default_value = {};
  Range range = {};                     // range of a number, or of each number of a vector
  std::vector<std::string> words = {};  // words of a choice, or words that may stand instead of a number
  bool required = false;
  std::string default_note = {};   // the default's origin when it is no constant
  KeyType entries = KeyType::map;  // type of each entry of a list
  std::vector<Key> keys = {};      // keys of a map, or of each map of a list
};

// "kg/m³" of "density_kg_per_m3"; empty: the name has no unit.
std::string unit_of(const std::string& key_name);

// The values of the keys that an engine added to a scene (engine_traits.h): one for each key that has a default or was
// given. The accessors throw std::exception for a key that is absent or of another type.
struct Options {
  std::map<std::string, KeyValue> values;

  bool has(const std::string& key) const { return values.contains(key); }
  double number(const std::string& key) const { return std::get<double>(values.at(key)); }
  bool boolean(const std::string& key) const { return std::get<bool>(values.at(key)); }
  const Vec3& vector(const std::string& key) const { return std::get<Vec3>(values.at(key)); }
  const std::string& text(const std::string& key) const { return std::get<std::string>(values.at(key)); }
};

}  // namespace sectio
