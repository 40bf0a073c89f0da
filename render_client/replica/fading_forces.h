// The forces at the tips of instruments, as contacts tell of them, for somebody who looks on.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "common/math/contact_model.h"

namespace sectio {

class FadingForces {
 public:
  static constexpr double kFades_s = 0.1;  // a contact that is as old is none any more

  void hear(const ContactModel& contact, double now_s) {
    by_tool_[contact.tool_id] = {contact.force_world_n.norm(), now_s};
  }
  // 0 when the last contact has faded; empty when none has ever been heard of.
  std::optional<double> force_n(std::uint32_t tool_id, double now_s) const {
    const auto force = by_tool_.find(tool_id);
    if (force == by_tool_.end()) return std::nullopt;
    return now_s - force->second.heard_s > kFades_s ? 0 : force->second.newton;
  }

 private:
  struct Force {
    double newton = 0, heard_s = 0;
  };
  std::map<std::uint32_t, Force> by_tool_;
};

}  // namespace sectio
