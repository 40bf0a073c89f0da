#include "sim_server/scene/yaml_value.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/joined.h"
#include "common/core/words.h"

namespace sectio {
namespace {

constexpr std::size_t kMostBytes = 4'000'000;  // a file may have

std::string place_of(const std::string& file, int line_from_0) {
  return file + ":" + std::to_string(line_from_0 + 1);
}
std::string place_of(const std::string& file, const YAML::Mark& mark) {
  return mark.is_null() ? file : place_of(file, mark.line);
}

}  // namespace

YamlValue::YamlValue(const YAML::Node& node, std::string file, std::string key)
    : node_(std::make_shared<YAML::Node>(node)), file_(std::move(file)), key_(std::move(key)) {}

void YamlValue::fail(const std::string& flaw) const {
  throw InputError(place() + ": " + (key_.empty() ? "" : key_ + ": ") + flaw);
}

std::string YamlValue::place() const {
  return stands_at_ ? place_of(file_, *stands_at_) : place_of(file_, node_->Mark());
}

YamlValue YamlValue::absent(const std::string& key) const {
  return {*node_, file_, path_of(key)};
}

std::string YamlValue::path_of(const std::string& key) const {
  return key_.empty() ? key : key_ + "." + key;
}

std::string YamlValue::got() const {
  switch (node_->Type()) {
    case YAML::NodeType::Scalar: {
      const std::string quote = node_->Tag() == "!" ? "\"" : "";
      return "got " + quote + shortened(node_->Scalar()) + quote;
    }
    case YAML::NodeType::Sequence:
      return "got a list of " + std::to_string(node_->size());
    case YAML::NodeType::Map:
      return "got a map";
    default:
      return "got nothing";
  }
}

double YamlValue::number(const Range& range) const {
  const bool plain = node_->IsScalar() && node_->Tag() != "!";
  const std::optional<double> value = plain ? finite_number(node_->Scalar()) : std::nullopt;
  if (!value) fail("expected a finite number, " + got());
  if (!range.contains(*value)) fail("expected " + range.text() + ", " + got());
  return *value;
}

Range YamlValue::range(const Range& each) const {
  std::istringstream text(node_->IsScalar() ? node_->Scalar() : "");
  std::vector<std::string> words;
  for (std::string word; text >> word;) words.push_back(word);
  const auto number_at = [&](std::size_t i) { return YamlValue(YAML::Node(words[i]), file_, key_).number(each); };
  try {
    if (words.size() == 1) return between(number_at(0), number_at(0));
    if (words.size() == 3 && words[0] == "at" && words[1] == "least") return at_least(number_at(2));
    if (words.size() == 3 && words[0] == "at" && words[1] == "most") return {.high = number_at(2)};
    if (words.size() == 3 && words[1] == "to" && number_at(0) <= number_at(2))
      return between(number_at(0), number_at(2));
  } catch (const InputError&) {  // the message is of the whole text
  }
  fail("expected a number" + (each.is_bounded() ? " " + each.text() : "") +
       ", \"at least NUMBER\", \"at most NUMBER\" or \"NUMBER to NUMBER\", " + got());
}

bool YamlValue::boolean() const {
  const std::string text = node_->IsScalar() && node_->Tag() != "!" ? node_->Scalar() : "";
  if (text != "true" && text != "false") fail("expected true or false, " + got());
  return text == "true";
}

std::string YamlValue::text() const {
  if (!node_->IsScalar() || node_->Scalar().empty()) fail("expected a text, " + got());
  const std::string& text = node_->Scalar();
  if (!is_printable(text)) fail("expected a text of one line, " + got());
  return text;
}

std::string YamlValue::name() const {
  const std::string name = text();
  const auto allowed = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.'; };
  if (name.size() > 64 || !std::all_of(name.begin(), name.end(), allowed) || name.front() == '.')
    fail("expected a name of at most 64 letters without accents, digits, _, - and ., got " + shortened(name, 64));
  return name;
}

bool YamlValue::is(const std::string& word) const {
  return node_->IsScalar() && node_->Scalar() == word;
}

std::string YamlValue::choice(const std::vector<std::string>& allowed) const {
  const std::string text = node_->IsScalar() ? node_->Scalar() : "";
  if (std::find(allowed.begin(), allowed.end(), text) == allowed.end()) {
    fail("expected " + std::string(allowed.size() > 1 ? "one of " : "") + joined(allowed) + ", " + got());
  }
  return text;
}

Vec3 YamlValue::vector3(const Range& each) const {
  if (!node_->IsSequence() || node_->size() != 3) fail("expected three numbers [x, y, z], " + got());
  Vec3 v;
  for (int i = 0; i < 3; ++i) {
    v[i] = YamlValue((*node_)[static_cast<std::size_t>(i)], file_, key_ + "[" + std::to_string(i) + "]").number(each);
  }
  return v;
}

std::vector<YamlValue> YamlValue::list() const {
  if (!node_->IsSequence()) fail("expected a list, " + got());
  if (node_->size() == 0) fail("expected at least one entry, the list is empty");
  std::vector<YamlValue> values;
  for (std::size_t i = 0; i < node_->size(); ++i) {
    values.emplace_back((*node_)[i], file_, key_ + "[" + std::to_string(i) + "]");
  }
  return values;
}

std::vector<YamlEntry> YamlValue::entries() const {
  if (!node_->IsMap()) fail("expected keys with values, " + got());
  std::vector<YamlEntry> entries;
  for (const auto& entry : *node_) {
    if (!entry.first.IsScalar()) YamlValue(entry.first, file_, key_).fail("expected a word as key");
    const std::string& word = entry.first.Scalar();
    const YamlValue key_place(entry.first, file_, path_of(shortened(word)));
    const auto same = [&](const YamlEntry& e) { return e.key == word; };
    if (std::ranges::any_of(entries, same)) key_place.fail("the key stands here for the second time");
    YamlValue value(entry.second, file_, path_of(word));
    if (entry.second.IsNull()) value.stands_at_ = entry.first.Mark().line;  // nothing stands in no line
    entries.push_back({word, key_place, value});
  }
  return entries;
}

namespace {

// Null when it is absent.
YAML::Node find_node(const YAML::Node& in, std::string_view key) {
  if (key.empty() || !in.IsDefined()) return in;
  if (key[0] == '.') key.remove_prefix(1);
  if (key[0] == '[') {
    std::size_t index = 0;
    const auto end = std::from_chars(key.data() + 1, key.data() + key.size(), index).ptr;
    return in.IsSequence() && index < in.size() ? find_node(in[index], {end + 1, key.data() + key.size()})
                                                : YAML::Node(YAML::NodeType::Undefined);
  }
  const std::size_t word = std::min(key.find_first_of(".["), key.size());
  return in.IsMap() ? find_node(in[std::string(key.substr(0, word))], key.substr(word))
                    : YAML::Node(YAML::NodeType::Undefined);
}

// Hears a document, and keeps nothing of it but its beginning.
struct Listener : YAML::EventHandler {
  YAML::Mark begin;
  void OnDocumentStart(const YAML::Mark& mark) override { begin = mark; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

// Up to the second one: yaml-cpp finds documents without end in some damaged files.
void refuse_unless_one(const std::string& path, const std::string& text) {
  std::istringstream in(text);
  YAML::Parser parser(in);
  Listener listener;
  if (!parser.HandleNextDocument(listener)) throw InputError(path + ": nothing in this file but comments");
  if (parser.HandleNextDocument(listener))
    throw InputError(place_of(path, listener.begin) + ": a second document begins; expected one");
}

// The first line that begins with a tab, and has something behind it, counted from 1; or 0.
int line_indented_by_tab(const std::string& text) {
  std::istringstream in(text);
  std::string line;
  for (int n = 1; std::getline(in, line); ++n) {
    const std::size_t word = line.find_first_not_of(" \t\r");
    if (word != std::string::npos && line.find('\t') < word) return n;
  }
  return 0;
}

// A device or a pipe may have no end.
std::string content_of(const std::string& path) {
  std::ifstream file(path);
  std::string content(kMostBytes + 1, '\0');
  file.read(content.data(), static_cast<std::streamsize>(content.size()));
  if (!file && !file.eof()) throw InputError(path + ": can't be read: " + std::strerror(errno));
  content.resize(static_cast<std::size_t>(file.gcount()));
  if (content.empty()) throw InputError(path + ": the file is empty");
  if (content.size() > kMostBytes) throw InputError(path + formatted(": more than %zu MB", kMostBytes / 1'000'000));
  return content;
}

YAML::Node document_of(const std::string& path) {
  const std::string content = content_of(path);
  try {
    refuse_unless_one(path, content);
    return YAML::Load(content);
  } catch (const YAML::Exception& error) {
    if (const int line = line_indented_by_tab(content); line > 0 && line <= error.mark.line + 1)
      throw InputError(path + ":" + std::to_string(line) + ": a tab indents this line; YAML takes spaces alone");
    throw InputError(place_of(path, error.mark) + ": " + shortened(error.msg));
  }
}

}  // namespace

YamlValue load_yaml(const std::string& path) {
  return {document_of(path), path, ""};
}

std::string yaml_with(const std::string& path, const std::vector<std::pair<std::string, std::string>>& values) {
  const YAML::Node document = document_of(path);
  for (const auto& [key, value] : values)
    if (YAML::Node node = find_node(document, key); node.IsDefined()) node = value;
  return YAML::Dump(document) + "\n";
}

}  // namespace sectio
