#include "sim_server/net/order_limit.h"

#include <algorithm>

namespace sectio {

bool OrderLimit::Buckets::are_open(bool begins_anew, double now_s) {
  return any.is_open(now_s) && (!begins_anew || anew.is_open(now_s));
}

void OrderLimit::Buckets::take(bool begins_anew) {
  any.take(1);
  if (begins_anew) anew.take(1);
}

OrderLimit::Buckets& OrderLimit::buckets_of(const ProgramId& program) {
  const auto known = std::ranges::find(programs_, program, &Program::id);
  if (known != programs_.end()) return known->buckets;
  if (programs_.size() >= kMostPrograms) programs_.pop_front();
  return programs_.emplace_back(Program{program}).buckets;
}

// A program that gives too many uses up its own share alone.
bool OrderLimit::allows(const ProgramId& program, OrderKind kind, double now_s) {
  const bool begins_anew = kind == OrderKind::begin_anew || kind == OrderKind::seek;
  Buckets& own = buckets_of(program);
  if (!own.are_open(begins_anew, now_s) || !all_.are_open(begins_anew, now_s)) {
    ++refused_;
    return false;
  }
  own.take(begins_anew);
  all_.take(begins_anew);
  return true;
}

}  // namespace sectio
