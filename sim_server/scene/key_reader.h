// Reads the keys of a map in a scene file. Each call names one key and says all that there is to say about it: type,
// range, default and meaning. The same calls on a reader without a file read nothing and leave a description of the
// map; so what the program reads and what it says that it reads cannot differ.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sim_server/scene/key.h"
#include "sim_server/scene/yaml_value.h"

namespace sectio {

class KeyReader {
 public:
  using ReadPart = std::function<void(KeyReader&)>;

  // Without a file: no key is given, and nothing is refused.
  KeyReader() = default;
  // Throws InputError, as all that follows, when the value is no map or holds a key twice.
  explicit KeyReader(const YamlValue& map);

  // About the next key only: it must be there; or its default is no constant, but `note`, so that none is described.
  KeyReader& required(bool is = true);
  KeyReader& default_of(const std::string& note);

  // `target` holds the default, which stays when the key is absent. number_or: the word `other` may stand instead.
  void number(const std::string& key, double& target, const Range& range, const std::string& meaning);
  void number(const std::string& key, std::optional<double>& target, const Range& range, const std::string& meaning);
  void number_or(const std::string& other, bool& is_other, const std::string& key, double& target, const Range& range,
                 const std::string& meaning);
  // Absent: nothing is expected.
  void range(const std::string& key, std::optional<Range>& target, const Range& each, const std::string& meaning);
  void boolean(const std::string& key, bool& target, const std::string& meaning);
  void vector(const std::string& key, Vec3& target, const Range& each, const std::string& meaning);
  void text(const std::string& key, std::string& target, const std::string& meaning);
  void name(const std::string& key, std::string& target, const std::string& meaning);
  void choice(const std::string& key, std::string& target, const std::vector<std::string>& allowed,
              const std::string& meaning);
  void numbers(const std::string& key, std::vector<double>& target, const Range& each, const std::string& meaning);
  void vectors(const std::string& key, std::vector<Vec3>& target, const Range& each, const std::string& meaning);
  void names(const std::string& key, std::vector<std::string>& target, const std::string& meaning);
  // rotation_deg: [x, y, z], about the axes of `frame`, x first.
  void rotation(Eigen::Quaterniond& target, const std::string& frame);

  // The map under a key, if there is one; each map of the list under it. Keys that read_part does not name are errors.
  void part(const std::string& key, const ReadPart& read_part, const std::string& meaning);
  void each(const std::string& key, const ReadPart& read_entry, const std::string& meaning);

  // The keys that engines described, of which the scene has chosen one (or none): keys of the others are errors.
  struct Owner {
    std::string label;  // "model x"
    bool is_chosen = false;
    std::vector<Key> keys;
  };
  void options(std::vector<Owner> owners, Options& options);

  // Errors at this map, or at the value of a key if it is given, when `good` is false.
  void check(bool good, const std::string& flaw) const;
  void check(const std::string& key, bool good, const std::string& flaw) const;

  // Whether it has no file.
  bool describes() const { return !map_; }
  // The value of a key that is given, whether it was named or not.
  std::optional<YamlValue> given(const std::string& key) const;
  // Throws at the first key that was not named, with the nearest one that was.
  void finish() const;
  // The line of this map as "FILE:LINE", or that of a key's value if it is given.
  std::string place(const std::string& key = {}) const;
  // The keys that were named, in order.
  const std::vector<Key>& keys() const { return keys_; }

 private:
  // Remembers the description, and returns the value if it is given.
  std::optional<YamlValue> take(Key key);
  void describe_option(const std::string& owner, Key key);
  void read_option(const Key& key, Options& options);
  std::vector<std::string> known() const;

  std::optional<YamlValue> map_;
  std::vector<YamlEntry> entries_;
  std::vector<Key> keys_;
  bool required_ = false;     // the next key is required
  std::string default_note_;  // note on the default of the next key
};

}  // namespace sectio
