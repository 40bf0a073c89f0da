#include "sim_server/net/order_limit.h"

#include <algorithm>
#include <utility>

namespace sectio {

OrderLimit::Program& OrderLimit::known(const ProgramId& program) {
  const auto known = std::ranges::find(programs_, program, &Program::id);
  if (known != programs_.end()) return *known;
  if (programs_.size() >= kMostPrograms) programs_.pop_front();
  return programs_.emplace_back(Program{program});
}

// A program that gives too many uses up its own share alone: an order that is not obeyed counts as one of the
// program's, and not as one of all.
bool OrderLimit::allows(const ProgramId& program, OrderKind kind, double now_s) {
  const bool takes_long = kind == OrderKind::begin_anew || kind == OrderKind::seek || kind == OrderKind::tell_score;
  Program& own = known(program);
  const double quiet_s = now_s - std::exchange(own.spoke_s, now_s);
  own.is_flood = (own.is_flood && quiet_s < kQuiet_s) || !own.buckets.any.is_open(now_s);
  const auto refuse = [&] {
    ++refused_;
    return false;
  };
  if (own.is_flood) return refuse();
  own.buckets.any.take(1);
  if (!all_.any.is_open(now_s)) return refuse();
  if (takes_long) {
    if (!own.buckets.long_ones.is_open(now_s) || !all_.long_ones.is_open(now_s)) return refuse();
    own.buckets.long_ones.take(1);
    all_.long_ones.take(1);
  }
  all_.any.take(1);
  return true;
}

}  // namespace sectio
