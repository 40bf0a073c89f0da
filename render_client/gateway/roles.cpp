#include "render_client/gateway/roles.h"

#include <algorithm>
#include <utility>

namespace sectio {

void Roles::set_tools(const std::vector<std::string>& names) {
  for (std::uint32_t t = 0; t < tools_.size(); ++t) {
    if (tools_[t].person == kNobody || (t < names.size() && names[t] == tools_[t].name)) continue;
    notices_.emplace_back(tools_[t].person, "you hold the " + tools_[t].name + " no more: the session has others now");
    set_free(t);
  }
  tools_.resize(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) tools_[i].name = names[i];
  changed_ = true;
}

std::uint32_t Roles::enter() {
  const std::uint32_t id = ++last_id_;
  people_[id] = {id, "guest " + std::to_string(id)};
  changed_ = true;
  return id;
}

void Roles::leave(std::uint32_t person) {
  for (std::uint32_t t = 0; t < tools_.size(); ++t)
    if (tools_[t].person == person) set_free(t);
  people_.erase(person);
  changed_ = true;
}

// Two people of one name are told apart by numbers. A name that has no room for one stays as it is.
std::string Roles::free_name(std::uint32_t person, const std::string& wanted) const {
  const auto is_free = [&](const std::string& name) {
    return std::ranges::none_of(people_,
                                [&](const auto& each) { return each.first != person && each.second.name == name; });
  };
  std::string name = wanted;
  for (int n = 2; !is_free(name); ++n) name = wanted + " (" + std::to_string(n) + ")";
  return name.size() <= kMaxNameBytes ? name : wanted;
}

bool Roles::hello(std::uint32_t person, const Hello& hello) {
  Person& p = people_.at(person);
  if (!hello.name.empty()) p.name = free_name(person, hello.name);
  p.may_lead = hello.token == (tokens_.lead.empty() ? tokens_.hold : tokens_.lead);
  p.may_write = p.may_lead || hello.token == tokens_.hold;
  changed_ = true;
  return p.may_write || hello.token.empty();
}

bool Roles::may_lead(std::uint32_t person) const {
  const auto at = people_.find(person);
  return at != people_.end() && at->second.may_lead;
}

std::string Roles::act(std::uint32_t person, const ToolClaim& claim, double now_s) {
  if (claim.tool_id >= tools_.size()) return "the scene has no such instrument";
  const Holding& tool = tools_[claim.tool_id];
  if (!people_.at(person).may_write) return "observers can't hold the " + tool.name;
  const bool is_own = tool.person == person;
  switch (claim.action) {
    case ClaimAction::claim:
      if (is_own) tools_[claim.tool_id].heard_s = now_s;  // a hand that has nothing to wish yet
      if (is_own) return "";
      if (tool.person != kNobody) return "the " + tool.name + " is held by " + name_of(tool.person);
      give(claim.tool_id, person, now_s);
      return "";
    case ClaimAction::take:
      if (is_own) return "";
      if (tool.person != kNobody)
        notices_.emplace_back(tool.person, name_of(person) + " has taken the " + tool.name + " from you");
      give(claim.tool_id, person, now_s);
      return "";
    case ClaimAction::give: {
      if (!is_own && !may_lead(person)) return "the " + tool.name + " isn't yours to give";
      if (!is_own && tool.person != kNobody)
        notices_.emplace_back(tool.person, name_of(person) + " has taken the " + tool.name + " from you");
      const auto to = people_.find(claim.person);
      if (to == people_.end()) return "the " + tool.name + " can't be given to somebody who isn't here";
      if (!to->second.may_write) return to->second.name + " only watches and can't hold the " + tool.name;
      notices_.emplace_back(claim.person, name_of(person) + " has given you the " + tool.name);
      give(claim.tool_id, claim.person, now_s);
      return "";
    }
    case ClaimAction::release:
      if (!is_own && !may_lead(person)) return "the " + tool.name + " isn't yours to put down";
      if (!is_own && tool.person != kNobody)
        notices_.emplace_back(tool.person, name_of(person) + " has put down the " + tool.name + " that you held");
      set_free(claim.tool_id);
      return "";
  }
  return "";
}

bool Roles::heard(std::uint32_t person, std::uint32_t tool_id, double now_s) {
  if (tool_id >= tools_.size() || tools_[tool_id].person != person || person == kNobody) return false;
  tools_[tool_id].heard_s = now_s;
  return true;
}

void Roles::tick(double now_s) {
  // The caller was asleep: what hands have said meanwhile hasn't been heard yet.
  if (now_s - ticked_s_ > kAsleep_s)
    for (Holding& tool : tools_) tool.heard_s = now_s;
  ticked_s_ = now_s;
  for (std::uint32_t t = 0; t < tools_.size(); ++t) {
    if (tools_[t].person == kNobody || now_s - tools_[t].heard_s < kHandSilence_s) continue;
    notices_.emplace_back(kNobody, "the " + tools_[t].name + " was taken from " + name_of(tools_[t].person) +
                                       ", whose hand was silent for 3 s");
    set_free(t);
  }
}

void Roles::give(std::uint32_t tool_id, std::uint32_t person, double now_s) {
  if (tools_[tool_id].person != kNobody) set_free(tool_id);
  for (std::uint32_t t = 0; t < tools_.size(); ++t)
    if (tools_[t].person == person) set_free(t);  // a page has one hand: it puts down what it held
  tools_[tool_id].person = person;
  tools_[tool_id].heard_s = now_s;
  changed_ = true;
}

void Roles::set_free(std::uint32_t tool_id) {
  tools_[tool_id].person = kNobody;
  freed_.push_back(tool_id);
  changed_ = true;
}

std::vector<std::pair<std::uint32_t, std::string>> Roles::take_notices() {
  return std::exchange(notices_, {});
}

std::vector<std::uint32_t> Roles::take_freed() {
  return std::exchange(freed_, {});
}

bool Roles::take_changed() {
  return std::exchange(changed_, false);
}

Roster Roles::roster_for(std::uint32_t person) const {
  Roster roster;
  roster.you = person;
  for (const auto& [id, p] : people_) roster.people.push_back(p);
  for (const Holding& tool : tools_) roster.holders.push_back(tool.person);
  return roster;
}

std::vector<std::string> Roles::hands() const {
  std::vector<std::string> names;
  for (const Holding& tool : tools_)
    if (tool.person != kNobody) names.push_back(name_of(tool.person));
  return names;
}

std::uint32_t Roles::holder(std::uint32_t tool_id) const {
  return tool_id < tools_.size() ? tools_[tool_id].person : kNobody;
}

}  // namespace sectio
