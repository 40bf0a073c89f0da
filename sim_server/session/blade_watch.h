// Notices blades that touch tissue for long without cutting it, and says why: a setting that a new user gets wrong.
#pragma once

#include <string>
#include <vector>

#include "sim_server/scene/scene.h"
#include "sim_server/world/step_io.h"

namespace sectio {

class BladeWatch {
 public:
  explicit BladeWatch(const Scene& scene);  // the scene must outlive the watch

  // Call after each step. Warnings, at most one for each tool: it has been in contact for kPatience_s and has never
  // cut.
  std::vector<std::string> add(const StepOutput& output);

  // At the end. Warnings of blades that have touched tissue for kTouch_s, have never cut and have not been warned of.
  std::vector<std::string> finish() const;

  static constexpr double kPatience_s = 2, kTouch_s = 0.25;

  template <class A>
  void archive(A& a) {
    a(blades_);
  }

 private:
  struct Blade {
    bool watched = false;  // it can cut, has not, and has not been warned of
    double contact_time_s = 0, smooth_force_n = 0, largest_force_n = 0;
    std::uint32_t body_id = 0;  // reason of its last refused cut
    std::string refusal;        // reason for refusing its last refused cut
    std::string remark;         // on a cut that it did not begin

    template <class A>
    void archive(A& a) {
      a(watched, contact_time_s, smooth_force_n, largest_force_n, body_id, refusal, remark);
    }
  };
  std::string warning(std::uint32_t tool) const;
  std::string reason(std::uint32_t tool, const Blade& blade) const;

  const Scene& scene_;
  std::vector<Blade> blades_;
};

}  // namespace sectio
