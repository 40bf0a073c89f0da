#include "sim_server/collision/contact.h"

#include <algorithm>

namespace sectio {

bool ToolContact::touches() const {
  return std::any_of(
             segments.begin(), segments.end(),
             [](const SegmentContact& s) { return !s.before.empty() || !s.after.empty() || !s.swept.empty(); }) ||
         std::any_of(corner_paths.begin(), corner_paths.end(), [](const auto& path) { return !path.empty(); });
}

}  // namespace sectio
