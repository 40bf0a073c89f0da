// Every stroke of a blade: when it broke in, and when and why its cut ended. For those who read a report to learn what
// became of a cut.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim_server/world/step_io.h"

namespace sectio {

struct StrokeEntry {
  std::uint32_t tool_id = 0, body_id = 0;
  std::uint64_t from_step = 0, to_step = 0;  // to_step 0: the blade is still in the tissue
  std::string end;                           // for a person
  bool is_over = false;                      // it won't go on, as one may that has run into a cut, or was refused

  template <class A>
  void archive(A& a) {
    a(tool_id, body_id, from_step, to_step, end, is_over);
  }
};

class StrokeLog {
 public:
  static constexpr std::size_t kMost = 1000;  // later ones are left out

  void add(const Event& event);
  const std::vector<StrokeEntry>& strokes() const { return strokes_; }

  template <class A>
  void archive(A& a) {
    a(strokes_);
  }

 private:
  std::vector<StrokeEntry> strokes_;
};

}  // namespace sectio
