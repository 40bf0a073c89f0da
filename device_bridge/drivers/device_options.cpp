#include "device_bridge/drivers/device_options.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "common/core/error.h"
#include "common/core/joined.h"

namespace sectio {
namespace {

std::optional<double> number_of(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::size_t from = 0;
  for (std::size_t end = text.find(at); end != std::string::npos; end = text.find(at, from)) {
    parts.push_back(text.substr(from, end - from));
    from = end + 1;
  }
  parts.push_back(text.substr(from));
  return parts;
}

std::string shown(double value) {
  std::array<char, 32> text;
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end};
}

}  // namespace

DeviceOptions::DeviceOptions(const std::string& text) : name_(text.substr(0, text.find(':'))) {
  if (name_.size() == text.size()) return;
  for (const std::string& option : split(text.substr(name_.size() + 1), ',')) {
    const std::size_t equals = option.find('=');
    if (equals == std::string::npos || equals == 0) refuse("expected KEY=VALUE, got '" + option + "'");
    if (!values_.emplace(option.substr(0, equals), option.substr(equals + 1)).second)
      refuse(option.substr(0, equals) + ": given twice");
  }
}

const std::string* DeviceOptions::find(const std::string& key) {
  known_.push_back(key);
  const auto at = values_.find(key);
  return at == values_.end() ? nullptr : &at->second;
}

double DeviceOptions::number(const std::string& key, double value, double least, double most) {
  const std::string* given = find(key);
  if (!given) return value;
  const std::optional<double> read = number_of(*given);
  if (!read || *read < least || *read > most)
    refuse(key + ": expected " + shown(least) + " to " + shown(most) + ", got '" + *given + "'");
  return *read;
}

std::string DeviceOptions::text(const std::string& key, const std::string& value) {
  const std::string* given = find(key);
  if (given && given->empty()) refuse(key + ": expected a text, got none");
  return given ? *given : value;
}

std::optional<Vec3> DeviceOptions::place_m(const std::string& key) {
  const std::string* given = find(key);
  if (!given) return std::nullopt;
  const std::vector<std::string> parts = split(*given, '/');
  Vec3 place_m = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::optional<double> read = parts.size() == 3 ? number_of(parts[i]) : std::nullopt;
    if (!read || std::abs(*read) > 10) refuse(key + ": expected X/Y/Z in metres, got '" + *given + "'");
    place_m[static_cast<int>(i)] = *read;
  }
  return place_m;
}

void DeviceOptions::check_keys() const {
  const std::string names = joined(known_);
  for (const auto& [key, value] : values_)
    if (std::find(known_.begin(), known_.end(), key) == known_.end())
      refuse("it has no option '" + key + "'; " + (names.empty() ? "it has none" : "there are " + names));
}

void DeviceOptions::refuse(const std::string& what) const {
  throw InputError("--device " + name_ + ": " + what);
}

}  // namespace sectio
