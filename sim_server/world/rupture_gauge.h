// Whether the surface breaks under what presses it: the push through a low-pass, against the threshold of the tissue.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

class RuptureGauge {
 public:
  explicit RuptureGauge(const RuptureThreshold& threshold) : threshold_(threshold) {}

  void push(double push_n, double step_s) { smooth_push_n_ += share_of_push(step_s) * (push_n - smooth_push_n_); }
  // Nothing pushes any more.
  void release() { smooth_push_n_ = 0; }
  // An instrument that has just been cutting breaks in again at less.
  void set_just_cut(bool has_just_cut) { has_just_cut_ = has_just_cut; }
  bool breaks(double displacement_m) const {
    return ruptures(threshold_, smooth_push_n_, displacement_m, has_just_cut_);
  }

  template <class A>
  void archive(A& a) {
    a(smooth_push_n_, has_just_cut_);
  }

 private:
  RuptureThreshold threshold_;
  double smooth_push_n_ = 0;
  bool has_just_cut_ = false;
};

}  // namespace sectio
