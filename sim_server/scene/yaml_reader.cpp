#include "sim_server/scene/yaml_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string short_number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", x);
  return text;
}

std::string shortened(std::string text) {
  for (char& c : text) c = std::iscntrl(static_cast<unsigned char>(c)) ? ' ' : c;
  return text.size() > 40 ? text.substr(0, 37) + "..." : text;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

// Levenshtein's distance.
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({changed, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

std::string place(const std::string& file, const YAML::Mark& mark) {
  return mark.is_null() ? file : file + ":" + std::to_string(mark.line + 1);
}

}  // namespace

bool Range::contains(double x) const {
  return (x > low || (low_allowed && x == low)) && (x < high || (high_allowed && x == high));
}

std::string Range::text() const {
  if (high == kInfinity) return (low_allowed ? ">= " : "> ") + short_number(low);
  return std::string("in ") + (low_allowed ? "[" : "(") + short_number(low) + ", " + short_number(high) +
         (high_allowed ? "]" : ")");
}

Range above(double low) {
  return {low, kInfinity, false, false};
}
Range at_least(double low) {
  return {low, kInfinity, true, false};
}
Range between(double low, double high) {
  return {low, high, true, true};
}
Range from_to_below(double low, double high) {
  return {low, high, true, false};
}
Range above_to(double low, double high) {
  return {low, high, false, true};
}

std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t least = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = word.size() > 100 ? least : edits(word, candidate);
    if (distance >= least || distance >= candidate.size()) continue;
    least = distance;
    best = candidate;
  }
  return best;
}

void YamlValue::fail(const std::string& what) const {
  throw InputError(place(file_, node_.Mark()) + ": " + (key_.empty() ? "" : key_ + ": ") + what);
}

std::string YamlValue::got() const {
  switch (node_.Type()) {
    case YAML::NodeType::Scalar: {
      const std::string quote = node_.Tag() == "!" ? "\"" : "";
      return "got " + quote + shortened(node_.Scalar()) + quote;
    }
    case YAML::NodeType::Sequence:
      return "got a list of " + std::to_string(node_.size());
    case YAML::NodeType::Map:
      return "got a map";
    default:
      return "got nothing";
  }
}

double YamlValue::number(const Range& range) const {
  double value = 0;
  const bool plain = node_.IsScalar() && node_.Tag() != "!";
  const std::string text = plain ? node_.Scalar() : "";
  const char* begin = text.data() + (text.size() > 1 && text[0] == '+' && text[1] != '-');
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty() || !std::isfinite(value)) {
    fail("expected a finite number, " + got());
  }
  if (!range.contains(value)) fail("expected " + range.text() + ", " + got());
  return value;
}

bool YamlValue::boolean() const {
  const std::string text = node_.IsScalar() && node_.Tag() != "!" ? node_.Scalar() : "";
  if (text != "true" && text != "false") fail("expected true or false, " + got());
  return text == "true";
}

std::string YamlValue::text() const {
  if (!node_.IsScalar() || node_.Scalar().empty()) fail("expected a text, " + got());
  const std::string& text = node_.Scalar();
  if (std::any_of(text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; })) {
    fail("expected a text of one line, " + got());
  }
  return text;
}

bool YamlValue::is(const std::string& word) const {
  return node_.IsScalar() && node_.Scalar() == word;
}

std::string YamlValue::choice(const std::vector<std::string>& allowed) const {
  const std::string text = node_.IsScalar() ? node_.Scalar() : "";
  if (std::find(allowed.begin(), allowed.end(), text) == allowed.end()) {
    fail("expected " + std::string(allowed.size() > 1 ? "one of " : "") + joined(allowed) + ", " + got());
  }
  return text;
}

Vec3 YamlValue::vector3(const Range& each) const {
  if (!node_.IsSequence() || node_.size() != 3) fail("expected three numbers [x, y, z], " + got());
  Vec3 v;
  for (int i = 0; i < 3; ++i) {
    v[i] = YamlValue(node_[static_cast<std::size_t>(i)], file_, key_ + "[" + std::to_string(i) + "]").number(each);
  }
  return v;
}

std::vector<YamlValue> YamlValue::list() const {
  if (!node_.IsSequence()) fail("expected a list, " + got());
  if (node_.size() == 0) fail("expected at least one entry, the list is empty");
  std::vector<YamlValue> values;
  for (std::size_t i = 0; i < node_.size(); ++i) {
    values.emplace_back(node_[i], file_, key_ + "[" + std::to_string(i) + "]");
  }
  return values;
}

YamlMap::YamlMap(YamlValue value) : value_(std::move(value)) {
  if (!value_.node_.IsMap()) value_.fail("expected keys with values, " + value_.got());
  std::vector<std::string> seen;
  for (const auto& entry : value_.node_) {
    const YamlValue key(entry.first, value_.file_, value_.key_);
    if (!entry.first.IsScalar()) key.fail("expected a word as key");
    const std::string& word = entry.first.Scalar();
    const YamlValue named(entry.first, value_.file_, path_of(shortened(word)));
    if (std::find(seen.begin(), seen.end(), word) != seen.end()) named.fail("the key stands here for the second time");
    seen.push_back(word);
  }
}

std::string YamlMap::path_of(const std::string& key) const {
  return value_.key_.empty() ? key : value_.key_ + "." + key;
}

std::optional<YamlValue> YamlMap::find(const std::string& key) {
  asked_.push_back(key);
  for (const auto& entry : value_.node_) {
    if (entry.first.Scalar() == key) return YamlValue(entry.second, value_.file_, path_of(key));
  }
  return {};
}

YamlValue YamlMap::require(const std::string& key) {
  if (auto found = find(key)) return *found;
  std::vector<std::string> present;
  for (const auto& entry : value_.node_) {
    const std::string& word = entry.first.Scalar();
    if (std::find(asked_.begin(), asked_.end(), word) == asked_.end()) present.push_back(word);
  }
  const std::string meant = nearest_word(key, present);
  YamlValue(value_.node_, value_.file_, path_of(key))
      .fail("missing" + (meant.empty() ? "" : "; is \"" + meant + "\" meant to be it?"));
}

void YamlMap::read(const std::string& key, double& target, const Range& range) {
  if (const auto found = find(key)) target = found->number(range);
}
void YamlMap::read(const std::string& key, bool& target) {
  if (const auto found = find(key)) target = found->boolean();
}
void YamlMap::read(const std::string& key, Vec3& target, const Range& each) {
  if (const auto found = find(key)) target = found->vector3(each);
}
void YamlMap::read(const std::string& key, std::string& target, const std::vector<std::string>& allowed) {
  if (const auto found = find(key)) target = found->choice(allowed);
}

void YamlMap::part(const std::string& key, const std::function<void(YamlMap&)>& read_part) {
  const auto found = find(key);
  if (!found) return;
  YamlMap map(*found);
  read_part(map);
  map.finish();
}

void YamlMap::finish() const {
  for (const auto& entry : value_.node_) {
    const std::string& word = entry.first.Scalar();
    if (std::find(asked_.begin(), asked_.end(), word) != asked_.end()) continue;
    const std::string meant = nearest_word(word, asked_);
    YamlValue(entry.first, value_.file_, path_of(shortened(word)))
        .fail("unknown key; " + (meant.empty() ? "known are " + joined(asked_) : "did you mean " + meant + "?"));
  }
}

YamlMap load_yaml(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream content;
  if (!file || !(content << file.rdbuf())) throw InputError(path + ": can't be read, or is empty");
  std::vector<YAML::Node> documents;
  try {
    documents = YAML::LoadAll(content.str());
  } catch (const YAML::Exception& error) {
    throw InputError(place(path, error.mark) + ": " + shortened(error.msg));
  }
  if (documents.size() != 1)
    throw InputError(path + ": expected one document, got " + std::to_string(documents.size()));
  return YamlMap(YamlValue(documents[0], path, ""));
}

Eigen::Quaterniond read_rotation(YamlMap& map) {
  Vec3 rotation_deg = Vec3::Zero();
  map.read("rotation_deg", rotation_deg);
  const Vec3 angle = rotation_deg * (M_PI / 180);
  return Eigen::AngleAxisd(angle.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(angle.y(), Vec3::UnitY()) *
         Eigen::AngleAxisd(angle.x(), Vec3::UnitX());
}

}  // namespace sectio
