// The keys of a program: they say who it is and what it may do in a session (docs/security.md). deploy/keys makes them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/messages/epoch_owners.h"

namespace sectio {

struct NetworkOptions;

class Keys {
 public:
  // The keys that the options name, or SECTIO_KEYS in the environment; nothing: the program has none. Throws InputError
  // with one line for keys that can't be used: damaged, expired, revoked, for other domains.
  static std::optional<Keys> of(const NetworkOptions& options);

  const std::string& directory() const { return directory_; }
  const std::string& authority() const { return authority_; }
  const std::string& identity() const { return identity_; }  // "observer-ward"

  // The properties of a DDS participant: DDS Security, with the plugins that every vendor has.
  std::vector<std::pair<std::string, std::string>> properties() const;

 private:
  explicit Keys(std::string directory);
  std::string file(const char* name) const { return directory_ + "/" + name; }

  std::string directory_;
  std::string authority_, identity_;
};

// The name of the trainee who moves an instrument.
constexpr const char* kTrainee = "trainee-";
std::string trainee_of(std::uint32_t tool_id);
// The instrument of a trainee, from the identity of a program that has been authenticated: its first bytes are a hash
// of the name in its certificate (DDS Security 1.1, 9.3.3). Nothing: not a trainee.
std::optional<std::uint32_t> instrument_of_trainee(const ProgramId& program);

}  // namespace sectio
