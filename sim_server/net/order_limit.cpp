#include "sim_server/net/order_limit.h"

#include <algorithm>

namespace sectio {

bool OrderLimit::Buckets::are_open(bool takes_long, double now_s) {
  return any.is_open(now_s) && (!takes_long || long_ones.is_open(now_s));
}

void OrderLimit::Buckets::take(bool takes_long) {
  any.take(1);
  if (takes_long) long_ones.take(1);
}

OrderLimit::Buckets& OrderLimit::buckets_of(const ProgramId& program) {
  const auto known = std::ranges::find(programs_, program, &Program::id);
  if (known != programs_.end()) return known->buckets;
  if (programs_.size() >= kMostPrograms) programs_.pop_front();
  return programs_.emplace_back(Program{program}).buckets;
}

// A program that gives too many uses up its own share alone.
bool OrderLimit::allows(const ProgramId& program, OrderKind kind, double now_s) {
  const bool takes_long = kind == OrderKind::begin_anew || kind == OrderKind::seek || kind == OrderKind::tell_score;
  Buckets& own = buckets_of(program);
  if (!own.are_open(takes_long, now_s) || !all_.are_open(takes_long, now_s)) {
    ++refused_;
    return false;
  }
  own.take(takes_long);
  all_.take(takes_long);
  return true;
}

}  // namespace sectio
