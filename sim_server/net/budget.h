// The budget of a live session: the reaction when steps take longer than their time. Virtual Cutting of Anatomical
// Structures, section 2.1, has two: reduce the simulation, or show its results some frames later. One of:
//
//   kept      the session keeps pace with the clock on the wall
//   deferred  at most kFewFrames behind, or nothing may be reduced: late steps are made up for without a pause, and
//             their results are shown when they are there
//   reduced   further behind, and some bodies are touched by no instrument: these bodies are left as they are until
//             the session is less than a frame behind; their time stands still, and nothing of them is lost
//   slowed    further behind still: the clock is set back, and simulated time runs slower than the clock on the wall
//
// The fourth way, more processors, is for the user to choose: sim_server --bodies divides the bodies over servers.
// The budget depends on the clock alone, so offline runs have none, and a session that must go the same way every time
// (--play-traces) reduces nothing.
#pragma once

#include <cstdint>

namespace sectio {

enum class Budget : std::uint8_t { kept, deferred, reduced, slowed };
const char* to_string(Budget budget);

class BudgetPlanner {
 public:
  static constexpr double kFrame_s = 1.0 / 60;
  static constexpr double kFewFrames = 4;
  static constexpr double kGiveUp_s = 0.25;

  explicit BudgetPlanner(bool may_reduce = true) : may_reduce_(may_reduce) {}

  // Call before each step. `behind_s`: how far the session's clock is behind the clock on the wall.
  Budget plan(double behind_s);
  Budget now() const { return now_; }
  // The last plan() began or ended something that is seen: leaving bodies alone, or slowing down. To be late for a
  // moment is how every session goes.
  bool changed() const { return changed_; }

  std::uint64_t steps(Budget budget) const { return steps_[static_cast<int>(budget)]; }
  double most_behind_s() const { return most_behind_s_; }

 private:
  bool may_reduce_;
  Budget now_ = Budget::kept;
  bool changed_ = false;
  std::uint64_t steps_[4] = {};
  double most_behind_s_ = 0;
};

}  // namespace sectio
