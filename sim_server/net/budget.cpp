#include "sim_server/net/budget.h"

#include <algorithm>

namespace sectio {

const char* to_string(Budget budget) {
  switch (budget) {
    case Budget::kept:
      return "kept";
    case Budget::deferred:
      return "deferred";
    case Budget::reduced:
      return "reduced";
    case Budget::slowed:
      return "slowed";
  }
  return "?";
}

Budget BudgetPlanner::plan(double behind_s) {
  const Budget before = now_;
  most_behind_s_ = std::max(most_behind_s_, behind_s);
  const bool recovering = before >= Budget::reduced;
  if (behind_s > kGiveUp_s)
    now_ = Budget::slowed;
  else if (may_reduce_ && (behind_s > kFewFrames * kFrame_s || (recovering && behind_s > kFrame_s)))
    now_ = Budget::reduced;
  else if (behind_s > kFrame_s)
    now_ = Budget::deferred;
  else
    now_ = Budget::kept;
  ++steps_[static_cast<int>(now_)];
  changed_ = now_ != before && std::max(now_, before) >= Budget::reduced;
  return now_;
}

}  // namespace sectio
