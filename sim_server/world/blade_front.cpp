#include "sim_server/world/blade_front.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sectio {
namespace {

constexpr double kPart_m = 1e-4;  // length of the parts into which a motion is divided
constexpr int kMostParts = 64;
constexpr double kJumps_m = 0.02;    // a way this long in a step is no motion
constexpr double kNowhere_m = 1e-9;  // a shorter way has no direction
constexpr double kNothing_n = 1e-3;  // a weaker front has let go
constexpr double kSudden = 1.25;     // a front that is so many times as strong as before has met another one

double stiffness_of(double strength_n) {
  return std::min(BladeFront::kStiffest_n_per_m, strength_n / BladeFront::kYields_m);
}

}  // namespace

double BladeFront::stiffness_n_per_m() const {
  return stiffness_of(strength_n_);
}

void BladeFront::begin_step(double step_s) {
  const double left = std::exp(-step_s / kEbbs_s);
  const bool was_met = std::exchange(met_, false);
  least_n_ = was_met && strength_n_ > kNothing_n ? left * strength_n_ : 0;
  most_n_ = left * force_n_.norm();
  gives_way_ = std::exchange(ebbs_, false) ? 1 - left : 0;
}

// The anchor goes on towards the edge, for nothing.
void BladeFront::give_way(SweptTissue& tissue, const EdgeAtRest& edge, double share) {
  const EdgeAtRest anchor = edge.moved(-stretched_m_);
  stretched_m_ *= 1 - share;
  area_m2_ += tissue.sweep(anchor, edge.moved(-stretched_m_), ahead_, way_);
}

void BladeFront::move(SweptTissue& tissue, const EdgeAtRest& edge, const std::optional<Vec3>& sharp_side,
                      double toughness_j_per_m2) {
  work_j_ = 0;
  const EdgeAtRest from = edge_.value_or(edge);
  const double way_m = std::max((edge.tip_m - from.tip_m).norm(), (edge.heel_m - from.heel_m).norm());
  if (way_m > kJumps_m) {
    release();
    edge_ = edge;
    return;
  }
  edge_ = from;
  met_ = true;
  if (gives_way_ > 0 && way_) give_way(tissue, from, std::exchange(gives_way_, 0));
  const int parts = std::clamp(static_cast<int>(std::ceil(way_m / kPart_m)), 1, kMostParts);
  for (int i = 1; i <= parts; ++i) {
    const double share = static_cast<double>(i) / parts;
    const EdgeAtRest next{from.tip_m + share * (edge.tip_m - from.tip_m),
                          from.heel_m + share * (edge.heel_m - from.heel_m)};
    const Vec3 before_n = force_n_, step_m = next.at(middle_) - edge_->at(middle_);
    stretched_m_ += step_m;
    edge_ = next;
    advance(tissue, next, sharp_side, toughness_j_per_m2);
    work_j_ -= 0.5 * (before_n + force_n_).dot(step_m);
  }
}

void BladeFront::advance(SweptTissue& tissue, const EdgeAtRest& edge, const std::optional<Vec3>& sharp_side,
                         double toughness_j_per_m2) {
  const double before_n = std::exchange(strength_n_, 0);
  force_n_.setZero();
  const Vec3 along = edge.along();
  const Vec3 across = sharp_side.value_or(stretched_m_);
  const Vec3 ahead = across - across.dot(along) * along;
  if (ahead.norm() < kNowhere_m) return;
  ahead_ = ahead.normalized();
  if (stretched_m_.dot(ahead_) <= kNowhere_m) stretched_m_.setZero();  // it goes back
  const SweptTissue::Front front = tissue.front(edge.moved(-stretched_m_), ahead_, way_);
  if (!front.in_tissue) return stretched_m_.setZero(), void();
  if (front.length_m > 0) middle_ = front.middle;
  strength_n_ = toughness_j_per_m2 * front.length_m;
  // The edge has not pressed yet against tissue that it meets only now.
  if (before_n > 0 && strength_n_ > kSudden * before_n)
    give_way(tissue, edge, 1 - stiffness_of(before_n) / stiffness_of(strength_n_));
  const double size_m = stretched_m_.norm();
  if (size_m > 0 && strength_n_ < least_n_) ebbs_ = true, strength_n_ = least_n_;
  if (!(size_m > 0 && strength_n_ > 0)) return stretched_m_.setZero(), void();
  double most_m = strength_n_ / stiffness_n_per_m() * stretched_m_.dot(ahead_) / size_m;
  if (ebbs_) most_m = std::min(most_m, most_n_ / stiffness_n_per_m());
  if (size_m > most_m) give_way(tissue, edge, 1 - most_m / size_m);
  force_n_ = -stiffness_n_per_m() * stretched_m_;
}

}  // namespace sectio
