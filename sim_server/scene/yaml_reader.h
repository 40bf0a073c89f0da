// Typed reading of YAML that remembers where everything stands: whatever is wrong becomes an InputError
// "FILE:LINE: KEY: what is wrong". A map knows which of its keys were asked for; finish() makes all others errors.
// Only scene/*.cpp may include this header (it names types of yaml-cpp).
#pragma once

#include <yaml-cpp/yaml.h>

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/math/types.h"

namespace sectio {

struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_allowed = true;
  bool high_allowed = true;

  bool contains(double x) const;
  std::string text() const;  // "> 0", "in [0, 0.5)"
};
Range above(double low);
Range at_least(double low);
Range between(double low, double high);        // ends included
Range from_to_below(double low, double high);  // high excluded
Range above_to(double low, double high);       // low excluded

// A value and its place.
class YamlValue {
 public:
  YamlValue(const YAML::Node& node, std::string file, std::string key)
      : node_(node), file_(std::move(file)), key_(std::move(key)) {}

  double number(const Range& range = {}) const;
  bool boolean() const;
  std::string text() const;  // not empty, one line
  bool is(const std::string& word) const;
  std::string choice(const std::vector<std::string>& allowed) const;
  Vec3 vector3(const Range& each = {}) const;
  std::vector<YamlValue> list() const;  // not empty

  [[noreturn]] void fail(const std::string& what) const;
  const std::string& key() const { return key_; }

 private:
  friend class YamlMap;
  std::string got() const;  // the value as written, shortened

  YAML::Node node_;
  std::string file_, key_;
};

class YamlMap {
 public:
  // Duplicate keys are errors at once.
  explicit YamlMap(YamlValue value);

  std::optional<YamlValue> find(const std::string& key);
  YamlValue require(const std::string& key);

  // These leave `target` as it is (the default) when the key is absent.
  void read(const std::string& key, double& target, const Range& range = {});
  void read(const std::string& key, bool& target);
  void read(const std::string& key, Vec3& target, const Range& each = {});
  void read(const std::string& key, std::string& target, const std::vector<std::string>& allowed);

  // read_part gets the map under `key`, when there is one; its unknown keys are errors afterwards.
  void part(const std::string& key, const std::function<void(YamlMap&)>& read_part);

  // Throws at the first key that was never asked for, with the nearest one that was.
  void finish() const;

  const YamlValue& value() const { return value_; }

 private:
  std::string path_of(const std::string& key) const;

  YamlValue value_;
  std::vector<std::string> asked_;
};

// The one document of a file, which must be a map.
YamlMap load_yaml(const std::string& path);

// rotation_deg: [x, y, z], about the world's x, then y, then z axis; none when the key is absent.
Eigen::Quaterniond read_rotation(YamlMap& map);

// The candidate that differs least from `word` by letters put in, left out or changed, when it is near enough to be
// meant; "" otherwise.
std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace sectio
