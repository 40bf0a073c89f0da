#include "common/messages/session.h"

#include <algorithm>

namespace sectio {

bool overlap(const SceneInfo& a, const SceneInfo& b) {
  return std::ranges::any_of(a.bodies, [&](const BodyInfo& body) {
    return std::ranges::find(b.bodies, body.name, &BodyInfo::name) != b.bodies.end();
  });
}

bool is_same_event(const SessionEvent& a, const SessionEvent& b) {
  return a.step == b.step && a.kind == b.kind && a.body_id == b.body_id && a.tool_id == b.tool_id && a.text == b.text;
}

}  // namespace sectio
