#include "sim_server/scene/key_reader.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/joined.h"
#include "common/core/words.h"

namespace sectio {
namespace {

KeyValue value_of(const Key& key, const YamlValue& value) {
  switch (key.type) {
    case KeyType::boolean:
      return value.boolean();
    case KeyType::vector:
      return value.vector3(key.range);
    case KeyType::text:
      return value.text();
    case KeyType::name:
      return value.name();
    case KeyType::choice:
      return value.choice(key.words);
    default:
      return value.number(key.range);
  }
}

}  // namespace

KeyReader::KeyReader(const YamlValue& map) : map_(map), entries_(map.entries()) {}

KeyReader& KeyReader::required(bool is) {
  required_ = is;
  return *this;
}

KeyReader& KeyReader::default_of(const std::string& note) {
  default_note_ = note;
  return *this;
}

std::vector<std::string> KeyReader::known() const {
  std::vector<std::string> names;
  for (const Key& key : keys_) names.push_back(key.name);
  return names;
}

std::optional<YamlValue> KeyReader::given(const std::string& key) const {
  for (const YamlEntry& entry : entries_)
    if (entry.key == key) return entry.value;
  return {};
}

std::optional<YamlValue> KeyReader::take(Key key) {
  key.required = key.required || std::exchange(required_, false);
  key.default_note = std::exchange(default_note_, {});
  if (key.required || !key.default_note.empty()) key.default_value = {};
  keys_.push_back(std::move(key));
  const std::string& name = keys_.back().name;
  const std::optional<YamlValue> found = given(name);
  if (found || describes() || !keys_.back().required) return found;
  std::vector<std::string> unnamed;
  for (const YamlEntry& entry : entries_)
    if (std::ranges::find(keys_, entry.key, &Key::name) == keys_.end()) unnamed.push_back(entry.key);
  const std::string meant = nearest_word(name, unnamed);
  map_->absent(name).fail("missing" + (meant.empty() ? "" : "; is \"" + meant + "\" meant to be it?"));
}

void KeyReader::number(const std::string& key, double& target, const Range& range, const std::string& meaning) {
  if (const auto found = take({key, KeyType::number, meaning, target, range})) target = found->number(range);
}

void KeyReader::number(const std::string& key, std::optional<double>& target, const Range& range,
                       const std::string& meaning) {
  const KeyValue usual = target ? KeyValue(*target) : KeyValue();
  if (const auto found = take({key, KeyType::number, meaning, usual, range})) target = found->number(range);
}

void KeyReader::number_or(const std::string& other, bool& is_other, const std::string& key, double& target,
                          const Range& range, const std::string& meaning) {
  const auto found = take({key, KeyType::number, meaning, target, range, {other}});
  is_other = found && found->is(other);
  if (found && !is_other) target = found->number(range);
}

void KeyReader::range(const std::string& key, std::optional<Range>& target, const Range& each,
                      const std::string& meaning) {
  if (const auto found = take({.name = key, .type = KeyType::range, .meaning = meaning, .range = each}))
    target = found->range(each);
}

void KeyReader::boolean(const std::string& key, bool& target, const std::string& meaning) {
  if (const auto found = take({key, KeyType::boolean, meaning, target})) target = found->boolean();
}

void KeyReader::vector(const std::string& key, Vec3& target, const Range& each, const std::string& meaning) {
  if (const auto found = take({key, KeyType::vector, meaning, target, each})) target = found->vector3(each);
}

void KeyReader::text(const std::string& key, std::string& target, const std::string& meaning) {
  const KeyValue usual = target.empty() ? KeyValue() : KeyValue(target);
  if (const auto found = take({key, KeyType::text, meaning, usual})) target = found->text();
}

void KeyReader::name(const std::string& key, std::string& target, const std::string& meaning) {
  const KeyValue usual = target.empty() ? KeyValue() : KeyValue(target);
  if (const auto found = take({key, KeyType::name, meaning, usual})) target = found->name();
}

void KeyReader::choice(const std::string& key, std::string& target, const std::vector<std::string>& allowed,
                       const std::string& meaning) {
  const auto found = take({key, KeyType::choice, meaning, target, {}, allowed});
  if (found) target = found->choice(allowed);
}

void KeyReader::numbers(const std::string& key, std::vector<double>& target, const Range& each,
                        const std::string& meaning) {
  const auto found =
      take({.name = key, .type = KeyType::list, .meaning = meaning, .range = each, .entries = KeyType::number});
  if (!found) return;
  for (const YamlValue& value : found->list()) target.push_back(value.number(each));
}

void KeyReader::vectors(const std::string& key, std::vector<Vec3>& target, const Range& each,
                        const std::string& meaning) {
  const auto found =
      take({.name = key, .type = KeyType::list, .meaning = meaning, .range = each, .entries = KeyType::vector});
  if (!found) return;
  for (const YamlValue& value : found->list()) target.push_back(value.vector3(each));
}

void KeyReader::names(const std::string& key, std::vector<std::string>& target, const std::string& meaning) {
  const auto found = take({.name = key, .type = KeyType::list, .meaning = meaning, .entries = KeyType::name});
  if (!found) return;
  for (const YamlValue& value : found->list()) target.push_back(value.name());
}

void KeyReader::rotation(Eigen::Quaterniond& target, const std::string& frame) {
  Vec3 rotation_deg = Vec3::Zero();
  vector("rotation_deg", rotation_deg, {}, "Rotation about the " + frame + "'s x axis, then its y, then its z axis.");
  const Vec3 angle = rotation_deg * (M_PI / 180);
  target = Eigen::AngleAxisd(angle.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(angle.y(), Vec3::UnitY()) *
           Eigen::AngleAxisd(angle.x(), Vec3::UnitX());
}

void KeyReader::part(const std::string& key, const ReadPart& read_part, const std::string& meaning) {
  KeyReader described;
  if (describes()) read_part(described);
  const auto found = take({.name = key, .type = KeyType::map, .meaning = meaning, .keys = described.keys_});
  if (!found) return;
  KeyReader map(*found);
  read_part(map);
  map.finish();
}

void KeyReader::each(const std::string& key, const ReadPart& read_entry, const std::string& meaning) {
  KeyReader described;
  if (describes()) read_entry(described);
  const auto found = take({.name = key, .type = KeyType::list, .meaning = meaning, .keys = described.keys_});
  if (!found) return;
  for (const YamlValue& value : found->list()) {
    KeyReader map(value);
    read_entry(map);
    map.finish();
  }
}

void KeyReader::options(std::vector<Owner> owners, Options& options) {
  std::stable_partition(owners.begin(), owners.end(), [](const Owner& owner) { return owner.is_chosen; });
  for (const Owner& owner : owners) {
    for (const Key& key : owner.keys) {
      if (describes())
        describe_option(owner.label, key);
      else if (owner.is_chosen)
        read_option(key, options);
      else if (std::ranges::find(keys_, key.name, &Key::name) == keys_.end())
        check(key.name, false, "it is of " + owner.label);
    }
  }
}

// Two owners may have keys of one name.
void KeyReader::describe_option(const std::string& owner, Key key) {
  key.meaning = "For " + owner + " only: " + key.meaning;
  key.required = false;
  const auto same = std::ranges::find(keys_, key.name, &Key::name);
  if (same == keys_.end())
    keys_.push_back(std::move(key));
  else
    same->meaning += " " + key.meaning;
}

void KeyReader::read_option(const Key& key, Options& options) {
  if (const auto found = take(key))
    options.values[key.name] = value_of(key, *found);
  else if (!std::holds_alternative<std::monostate>(key.default_value))
    options.values[key.name] = key.default_value;
}

void KeyReader::check(bool good, const std::string& flaw) const {
  if (!good && map_) map_->fail(flaw);
}

void KeyReader::check(const std::string& key, bool good, const std::string& flaw) const {
  if (good) return;
  if (const auto value = given(key)) value->fail(flaw);
}

std::string KeyReader::place(const std::string& key) const {
  if (!map_) return {};
  return given(key).value_or(*map_).place();
}

void KeyReader::finish() const {
  for (const YamlEntry& entry : entries_) {
    if (std::ranges::find(keys_, entry.key, &Key::name) != keys_.end()) continue;
    const std::string meant = nearest_word(entry.key, known());
    entry.key_place.fail("unknown key; " +
                         (meant.empty() ? "known are " + joined(known()) : "did you mean " + meant + "?"));
  }
}

}  // namespace sectio
