// Ascending, and nothing twice.
#pragma once

#include <algorithm>
#include <vector>

namespace sectio {

template <class T>
void each_once(std::vector<T>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

}  // namespace sectio
