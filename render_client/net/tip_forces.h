// The forces at the tips of instruments, as the server tells hands of them. A participant of its own: a thousand
// messages a second are heard only where somebody looks at them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "common/dds/participant.h"

namespace sectio {

class TipForces {
 public:
  static constexpr double kFades_s = 0.1;  // a contact that is as old is none any more

  explicit TipForces(const NetworkOptions& options);
  ~TipForces();

  void poll(double now_s);
  // 0 when the last contact has faded; empty when none has ever been heard of.
  std::optional<double> force_n(std::uint32_t tool_id, double now_s) const;

 private:
  struct Wire;
  std::unique_ptr<Wire> wire_;
};

}  // namespace sectio
