// The people present and their instruments. An instrument has at most one holder. Without clock, socket or thread:
// time is passed in.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/messages/live.h"

namespace sectio {

class Roles {
 public:
  static constexpr double kHandSilence_s = 3;  // silence of a hand after which its instrument is taken from it

  // The words that a person must know to hold an instrument, and to lead the session. Empty: none, and whoever may hold
  // an instrument leads.
  struct Tokens {
    std::string hold, lead;
  };
  explicit Roles(Tokens tokens) : tokens_(std::move(tokens)) {}

  // The scene's instruments; those that were there, by the same name, keep their holders.
  void set_tools(const std::vector<std::string>& names);

  // A person comes, as an observer until hello(), and leaves; what they held is free then.
  std::uint32_t enter();
  void leave(std::uint32_t person);
  // False for a token that is neither empty nor a right one: then the person watches.
  bool hello(std::uint32_t person, const Hello& hello);

  // The reason why not, in a line for the person; empty when it is done.
  std::string act(std::uint32_t person, const ToolClaim& claim, double now_s);

  // A wish of a person for an instrument came in. False: it isn't theirs.
  bool heard(std::uint32_t person, std::uint32_t tool_id, double now_s);
  bool may_lead(std::uint32_t person) const;
  // Takes instruments from hands that have been silent for kHandSilence_s.
  void tick(double now_s);

  // Lines for persons that came up since the last call: to the loser of an instrument, and to all (kNobody).
  std::vector<std::pair<std::uint32_t, std::string>> take_notices();
  // Instruments that somebody has let go, or lost, since the last call.
  std::vector<std::uint32_t> take_freed();
  // Whether the roster has changed since the last call.
  bool take_changed();

  Roster roster_for(std::uint32_t person) const;
  std::uint32_t holder(std::uint32_t tool_id) const;
  const std::string& name_of(std::uint32_t person) const { return people_.at(person).name; }
  std::vector<std::string> hands() const;  // names of the people who hold instruments

 private:
  static constexpr double kAsleep_s = 1;

  struct Holding {
    std::string name;  // name of the instrument
    std::uint32_t person = kNobody;
    double heard_s = 0;
  };

  std::string free_name(std::uint32_t person, const std::string& wanted) const;
  void give(std::uint32_t tool_id, std::uint32_t person, double now_s);
  void set_free(std::uint32_t tool_id);

  Tokens tokens_;
  std::map<std::uint32_t, Person> people_;
  std::vector<Holding> tools_;
  std::uint32_t last_id_ = kNobody;
  bool changed_ = false;
  double ticked_s_ = 1e300;
  std::vector<std::pair<std::uint32_t, std::string>> notices_;
  std::vector<std::uint32_t> freed_;
};

}  // namespace sectio
