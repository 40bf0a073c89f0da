// Sorts a list and drops what stands in it twice.
#pragma once

#include <algorithm>
#include <vector>

namespace sectio {

template <class T>
void sort_unique(std::vector<T>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

}  // namespace sectio
