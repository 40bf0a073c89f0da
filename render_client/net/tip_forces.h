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
  explicit TipForces(const NetworkOptions& options);
  ~TipForces();

  void poll(double now_s);
  // FadingForces::force_n()
  std::optional<double> force_n(std::uint32_t tool_id, double now_s) const;

 private:
  struct Wire;
  std::unique_ptr<Wire> wire_;
};

}  // namespace sectio
