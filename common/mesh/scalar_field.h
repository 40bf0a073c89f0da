// A number for each vertex of a body that an engine publishes for others to see.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace sectio {

constexpr std::size_t kMaxScalars = 8;  // one body has at most so many

// A number for each vertex that an engine publishes of a body: wetness, temperature, damage.
struct ScalarField {
  std::string name;           // 1 to 64 printable bytes; each field of a body has another name
  float least = 0, most = 1;  // the range that viewers see; values beyond it are cut off
  std::vector<float> values;  // one a vertex slot; a NaN counts as `least`
  bool operator==(const ScalarField&) const = default;

  template <class A>
  void archive(A& a) {
    a(name, least, most, values);
  }
};

}  // namespace sectio
