// An epoch belongs to the program that began its session (epoch.h), else to the first one that has announced it with a
// SceneInfo and is still there. A server's message from anybody else is dropped, so that nobody can end, draw, or push
// in another's name. A program that has just come hears all announcements at once, and can't tell which came first: it
// waits for a moment before it believes one of another program than the one that began the session.
//
// A later term is believed at once, so that nobody misses a server that follows a dead one. A server that lives takes
// the session back with a term that is later still: the program that claimed it falsely isn't heard any more, and a
// further one only while the server is silent.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/messages/epoch.h"

namespace sectio {

class EpochOwners {
 public:
  static constexpr std::size_t kMostEpochs = 64;
  static constexpr std::size_t kMostOfOne = 4;  // epochs of one program: of a session begun anew, the newest
  static constexpr std::size_t kMostInLine = 4;
  static constexpr double kWaits_s = 0.5;
  static constexpr double kSpeaks_s = 1.5;               // a server that lives says its status more often
  static constexpr std::uint64_t kMostAhead = 1u << 12;  // terms that a follower may be ahead of the program that began

  // `is_there`: whether a program is still in the session. `now_s`: any steady clock.
  EpochOwners(std::function<bool(const ProgramId&)> is_there, std::function<double()> now_s)
      : is_there_(std::move(is_there)), now_s_(std::move(now_s)) {}

  // The program announces the epoch. True when it may speak for it.
  bool announce(std::uint64_t epoch, const ProgramId& program) {
    if (is_false(epoch, program) || (!lines_.contains(epoch) && !make_room(program))) return false;
    if (heard_s_.size() >= 2 * kMostEpochs)
      std::erase_if(heard_s_, [&](const auto& each) { return !names(each.first); });
    heard_s_.try_emplace(name_of_session(epoch), now_s_());
    if (!lines_.contains(epoch)) lines_[epoch].since_s = now_s_();
    std::vector<ProgramId>& line = lines_[epoch].programs;
    if (std::find(line.begin(), line.end(), program) == line.end()) {
      if (line.size() >= kMostInLine) std::erase_if(line, [&](const ProgramId& each) { return !is_there_(each); });
      if (has_begun(program, epoch))
        line.insert(line.begin(), program);
      else if (line.size() < kMostInLine)
        line.push_back(program);
    }
    take_back(epoch, program);
    return owns(epoch, program);
  }

  bool owns(std::uint64_t epoch, const ProgramId& program) {
    const auto at = lines_.find(epoch);
    if (at == lines_.end()) return false;
    std::vector<ProgramId>& line = at->second.programs;
    while (!line.empty() && line.front() != program && !is_there_(line.front())) line.erase(line.begin());
    if (!line.empty())
      return line.front() == program &&
             (has_begun(program, epoch) || (has_waited(epoch) && may_follow(epoch, program)));
    lines_.erase(at);
    return false;
  }

  // The end of a session can't be taken back: a term that is new has to last for a moment first.
  bool may_end(std::uint64_t epoch, const ProgramId& program) {
    return owns(epoch, program) && (has_begun(program, epoch) || now_s_() - lines_.at(epoch).since_s >= kWaits_s);
  }

  // A message of the program that owns the epoch has come.
  void hear(std::uint64_t epoch, const ProgramId& program) {
    Holder& holder = holders_[name_of_session(epoch)];
    if (epoch < holder.epoch) return;
    holder = {epoch, program, now_s_()};
    if (holders_.size() > 2 * kMostEpochs)
      std::erase_if(holders_, [&](const auto& each) { return !names(each.first); });
  }

  std::optional<ProgramId> owner(std::uint64_t epoch) const {
    const auto at = lines_.find(epoch);
    return at == lines_.end() ? std::nullopt : std::optional(at->second.programs.front());
  }

  bool belongs_to_another(std::uint64_t epoch, const ProgramId& program) const {
    const auto at = lines_.find(epoch);
    return at != lines_.end() && at->second.programs.front() != program;
  }

 private:
  struct Line {
    std::vector<ProgramId> programs;  // in the order of claims; never empty
    double since_s = 0;
  };
  struct Holder {  // the one that spoke in the newest term
    std::uint64_t epoch = 0;
    ProgramId program{};
    double heard_s = 0;
  };

  bool is_false(std::uint64_t epoch, const ProgramId& program) const {
    return false_.contains({name_of_session(epoch), program});
  }

  // A program that held the session before has a later term than others: they claimed theirs falsely.
  void take_back(std::uint64_t epoch, const ProgramId& program) {
    if (lines_.at(epoch).programs.front() != program) return;
    bool held_before = has_begun(program, epoch);
    std::set<ProgramId> others;
    for (const auto& [earlier, line] : lines_) {
      if (!takes_over(epoch, earlier)) continue;
      if (line.programs.front() == program)
        held_before = true;
      else if (held_before)
        others.insert(line.programs.begin(), line.programs.end());
    }
    others.erase(program);
    for (const ProgramId& other : others) {
      if (false_.size() >= kMostFalse) false_.erase(false_.begin());
      false_.insert({name_of_session(epoch), other});
    }
    std::erase_if(lines_, [&](const auto& each) { return is_false(each.first, each.second.programs.front()); });
  }

  // Whether a program that did not begin the session may hold this term of it.
  bool may_follow(std::uint64_t epoch, const ProgramId& program) const {
    const std::uint64_t name = name_of_session(epoch);
    for (const auto& [earlier, line] : lines_)
      if (takes_over(epoch, earlier) && epoch - earlier > kMostAhead && has_begun(line.programs.front(), earlier))
        return false;
    const auto is_of_it = [&](const auto& each) { return each.first == name; };
    if (std::none_of(false_.begin(), false_.end(), is_of_it)) return true;
    const auto holder = holders_.find(name);
    return holder == holders_.end() || holder->second.program == program || epoch < holder->second.epoch ||
           now_s_() - holder->second.heard_s > kSpeaks_s;
  }

  bool has_waited(std::uint64_t epoch) const {
    const auto heard = heard_s_.find(name_of_session(epoch));
    return heard != heard_s_.end() && now_s_() - heard->second >= kWaits_s;
  }
  bool names(std::uint64_t name) const {
    return std::any_of(lines_.begin(), lines_.end(),
                       [&](const auto& line) { return name_of_session(line.first) == name; });
  }
  bool make_room(const ProgramId& program) {
    const auto is_own = [&](const auto& each) { return each.second.programs.front() == program; };
    if (std::count_if(lines_.begin(), lines_.end(), is_own) >= static_cast<std::ptrdiff_t>(kMostOfOne))
      lines_.erase(std::find_if(lines_.begin(), lines_.end(), is_own));
    if (lines_.size() >= kMostEpochs)
      std::erase_if(lines_, [&](const auto& each) {
        return std::none_of(each.second.programs.begin(), each.second.programs.end(), is_there_);
      });
    return lines_.size() < kMostEpochs;
  }

  std::function<bool(const ProgramId&)> is_there_;
  std::function<double()> now_s_;
  static constexpr std::size_t kMostFalse = 64;
  std::map<std::uint64_t, Line> lines_;                  // by epoch
  std::map<std::uint64_t, double> heard_s_;              // by the name of a session: when it was announced first
  std::map<std::uint64_t, Holder> holders_;              // likewise
  std::set<std::pair<std::uint64_t, ProgramId>> false_;  // programs that claimed a session of this name falsely
};

}  // namespace sectio
