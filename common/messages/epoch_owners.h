// An epoch belongs to the first program that has announced it with a SceneInfo and is still there. A server's message
// from anybody else is dropped, so that nobody can end, draw or push in another's name.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

namespace sectio {

// A program on the wire: the prefix of the identities (GUID) of all its writers.
using ProgramId = std::array<std::uint8_t, 12>;

class EpochOwners {
 public:
  static constexpr std::size_t kMostEpochs = 64;
  static constexpr std::size_t kMostOfOne = 4;  // epochs of one program: of a session begun anew, the newest
  static constexpr std::size_t kMostInLine = 4;

  // `is_there`: whether a program is still in the session.
  explicit EpochOwners(std::function<bool(const ProgramId&)> is_there) : is_there_(std::move(is_there)) {}

  // The program announces the epoch. True when it may speak for it.
  bool announce(std::uint64_t epoch, const ProgramId& program) {
    if (!lines_.contains(epoch) && !make_room(program)) return false;
    std::vector<ProgramId>& line = lines_[epoch];
    if (std::find(line.begin(), line.end(), program) == line.end()) {
      if (line.size() >= kMostInLine) std::erase_if(line, [&](const ProgramId& each) { return !is_there_(each); });
      if (line.size() < kMostInLine) line.push_back(program);
    }
    return owns(epoch, program);
  }

  bool owns(std::uint64_t epoch, const ProgramId& program) {
    const auto at = lines_.find(epoch);
    if (at == lines_.end()) return false;
    std::vector<ProgramId>& line = at->second;
    while (!line.empty() && line.front() != program && !is_there_(line.front())) line.erase(line.begin());
    if (!line.empty()) return line.front() == program;
    lines_.erase(at);
    return false;
  }

  bool knows(std::uint64_t epoch) const { return lines_.contains(epoch); }

 private:
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
  std::map<std::uint64_t, std::vector<ProgramId>>
      lines_;  // by epoch, in the order of their announcements; none is empty
};

}  // namespace sectio
