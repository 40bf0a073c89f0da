#include "common/messages/session.h"

#include <algorithm>

namespace sectio {

bool overlap(const SceneInfo& a, const SceneInfo& b) {
  return std::ranges::any_of(a.bodies, [&](const BodyInfo& body) {
    return std::ranges::find(b.bodies, body.name, &BodyInfo::name) != b.bodies.end();
  });
}

}  // namespace sectio
