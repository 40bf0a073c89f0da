// The methods of the engines that ship, for tests of the planner.
#pragma once

#include <algorithm>

#include "sim_server/engine/standard_engines.h"

namespace sectio::test {

inline const std::vector<planning::Method>& methods() {
  static const std::vector<planning::Method> all = standard_engines().methods();
  return all;
}

inline const planning::Method& method(std::string_view name) {
  return *std::ranges::find(methods(), name, &planning::Method::name);
}

}  // namespace sectio::test
