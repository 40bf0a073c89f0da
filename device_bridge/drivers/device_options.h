// The text of --device: NAME, or NAME:KEY=VALUE,KEY=VALUE. A driver asks for the keys that it knows; whatever is left
// is an error, which names the keys that there are.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/math/types.h"

namespace sectio {

class DeviceOptions {
 public:
  // Throws InputError when `text` has no such form.
  explicit DeviceOptions(const std::string& text);

  const std::string& name() const { return name_; }

  // Each throws InputError "--device NAME: KEY: what is wrong".
  double number(const std::string& key, double value, double least, double most);
  std::string text(const std::string& key, const std::string& value);
  std::optional<Vec3> place_m(const std::string& key);  // X/Y/Z
  // Throws InputError when a key has not been asked for.
  void check_keys() const;

  [[noreturn]] void refuse(const std::string& what) const;

 private:
  const std::string* find(const std::string& key);

  std::string name_;
  std::map<std::string, std::string> values_;
  std::vector<std::string> known_;
};

}  // namespace sectio
