// Compares a body's model with the expectations for which it was chosen: margin, residual, energy, time.
#pragma once

#include <memory>
#include <vector>

#include "sim_server/world/body.h"
#include "sim_server/world/step_io.h"

namespace sectio {

class ModelCheck {
 public:
  static constexpr double kMostMargin = 1e9;  // a larger one is told as this

  explicit ModelCheck(const BodySpec& body) {
    check_.error_estimate = body.plan.error_estimate.value_or(0);
    check_.cpu_estimate = body.plan.cpu_estimate.value_or(0);
  }

  // Called after a step. `work_j`: work of instruments on the body; `disturbed`: the energy says nothing, because the
  // topology has changed, another body has touched it, or gravity turned; `took_s`: the processor's time.
  void stepped(Body& body, double step_s, double work_j, bool disturbed, double took_s);

  const BodyCheck& value() const { return check_; }
  double processor_s() const { return processor_s_; }                      // so far
  double largest_speed_m_per_s() const { return largest_speed_m_per_s_; }  // any vertex, so far

  template <class A>
  void archive(A& a) {
    a(check_, steps_, processor_s_, largest_speed_m_per_s_, is_due_, known_, energy_j_, work_j_);
  }

 private:
  BodyCheck check_;
  std::uint64_t steps_ = 0;
  double processor_s_ = 0, largest_speed_m_per_s_ = 0;
  bool is_due_ = false;  // the energy, by the next step that nothing disturbs
  bool known_ = false;   // energy_j_ is of this body as it is
  double energy_j_ = 0, work_j_ = 0;
};

}  // namespace sectio
