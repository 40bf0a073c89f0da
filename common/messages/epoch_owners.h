// An epoch belongs to the program that began its session (epoch.h), else to the first one that has announced it with a
// SceneInfo and is still there. A server's message from anybody else is dropped, so that nobody can end, draw, or push
// in another's name. A program that has just come hears all announcements at once, and can't tell which came first: it
// waits for a moment before it believes one of another program than the one that began the session.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
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

  // `is_there`: whether a program is still in the session. `now_s`: any steady clock.
  EpochOwners(std::function<bool(const ProgramId&)> is_there, std::function<double()> now_s)
      : is_there_(std::move(is_there)), now_s_(std::move(now_s)) {}

  // The program announces the epoch. True when it may speak for it.
  bool announce(std::uint64_t epoch, const ProgramId& program) {
    if (!lines_.contains(epoch) && !make_room(program)) return false;
    if (heard_s_.size() >= 2 * kMostEpochs)
      std::erase_if(heard_s_, [&](const auto& each) { return !names(each.first); });
    heard_s_.try_emplace(name_of_session(epoch), now_s_());
    std::vector<ProgramId>& line = lines_[epoch];
    if (std::find(line.begin(), line.end(), program) == line.end()) {
      if (line.size() >= kMostInLine) std::erase_if(line, [&](const ProgramId& each) { return !is_there_(each); });
      if (has_begun(program, epoch))
        line.insert(line.begin(), program);
      else if (line.size() < kMostInLine)
        line.push_back(program);
    }
    return owns(epoch, program);
  }

  bool owns(std::uint64_t epoch, const ProgramId& program) {
    const auto at = lines_.find(epoch);
    if (at == lines_.end()) return false;
    std::vector<ProgramId>& line = at->second;
    while (!line.empty() && line.front() != program && !is_there_(line.front())) line.erase(line.begin());
    if (!line.empty()) return line.front() == program && (has_begun(program, epoch) || has_waited(epoch));
    lines_.erase(at);
    return false;
  }

  bool belongs_to_another(std::uint64_t epoch, const ProgramId& program) const {
    const auto at = lines_.find(epoch);
    return at != lines_.end() && at->second.front() != program;
  }

 private:
  bool has_waited(std::uint64_t epoch) const {
    const auto heard = heard_s_.find(name_of_session(epoch));
    return heard != heard_s_.end() && now_s_() - heard->second >= kWaits_s;
  }
  bool names(std::uint64_t name) const {
    return std::any_of(lines_.begin(), lines_.end(),
                       [&](const auto& line) { return name_of_session(line.first) == name; });
  }
  bool make_room(const ProgramId& program) {
    const auto is_own = [&](const auto& each) { return each.second.front() == program; };
    if (std::count_if(lines_.begin(), lines_.end(), is_own) >= static_cast<std::ptrdiff_t>(kMostOfOne))
      lines_.erase(std::find_if(lines_.begin(), lines_.end(), is_own));
    if (lines_.size() >= kMostEpochs)
      std::erase_if(lines_,
                    [&](const auto& each) { return std::none_of(each.second.begin(), each.second.end(), is_there_); });
    return lines_.size() < kMostEpochs;
  }

  std::function<bool(const ProgramId&)> is_there_;
  std::function<double()> now_s_;
  std::map<std::uint64_t, std::vector<ProgramId>> lines_;  // by epoch, in the order of claims; none is empty
  std::map<std::uint64_t, double> heard_s_;                // by the name of a session: when it was announced first
};

}  // namespace sectio
