// What a live session does when steps take longer than their time (paper A, 2.1: reduce the complexity of the
// simulation, or show its results some frames later). One of:
//
//   deferred  at most kFewFrames behind (or where nothing may be reduced): the steps that are late are made without a
//   pause, and shown when they are there reduced   further behind, and there are bodies that no instrument touches:
//   these are left as they are until the
//             session is less than a frame behind; their time stands still, nothing of them is lost
//   slowed    still further: the clock is set back, and simulated time runs slower than the clock on the wall
//
// To divide the bodies over more processors is up to whoever starts the servers (sim_server --bodies).
// Only the clock decides, so offline runs know nothing of it; a session that must go the same way every time
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

  // Before each step: how far the clock of the session is behind the one on the wall.
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
