// A value of a YAML file that knows its place: whatever is wrong with it becomes an InputError
// "FILE:LINE: KEY: what is wrong".
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim_server/scene/key.h"

namespace YAML {  // NOLINT(readability-identifier-naming)
class Node;
}

namespace sectio {

struct YamlEntry;

class YamlValue {
 public:
  YamlValue(const YAML::Node& node, std::string file, std::string key);

  double number(const Range& range = {}) const;
  bool boolean() const;
  Range range(const Range& each = {}) const;  // by KeyType::range
  std::string text() const;                   // not empty, one line
  std::string name() const;                   // by KeyType::name
  bool is(const std::string& word) const;
  std::string choice(const std::vector<std::string>& allowed) const;
  Vec3 vector3(const Range& each = {}) const;
  std::vector<YamlValue> list() const;     // not empty
  std::vector<YamlEntry> entries() const;  // entries of a map; a key that stands there twice is an error

  [[noreturn]] void fail(const std::string& flaw) const;
  std::string place() const;  // "FILE:LINE"
  // An entry of this map that does not stand in the file: its errors name the map's line.
  YamlValue absent(const std::string& key) const;

 private:
  std::string got() const;  // the value as written, shortened
  std::string path_of(const std::string& key) const;

  std::shared_ptr<const YAML::Node> node_;
  std::string file_, key_;
  std::optional<int> stands_at_;  // line, from 0 on, where the node doesn't know it
};

struct YamlEntry {
  std::string key;
  YamlValue key_place;  // for errors about the key itself
  YamlValue value;
};

// The one document of a file.
YamlValue load_yaml(const std::string& path);

// The document of a file as text, without its comments, where some values stand as given; a key that is absent stays
// so. Keys are named as in errors: "bodies[0].mesh.file".
std::string yaml_with(const std::string& path, const std::vector<std::pair<std::string, std::string>>& values);

}  // namespace sectio
