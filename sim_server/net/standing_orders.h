// The orders that hold until others come, of pace and of frozen instruments, in a file of a session's directory: a
// server that goes on after a crash finds a paused session paused.
#pragma once

#include <cstdint>
#include <string>

namespace sectio {

struct StandingOrders {
  double speed = 1;
  bool is_paused = false;
  std::uint32_t frozen_tools = 0;  // bit t: nobody moves tool t
};

// DIRECTORY/orders. Empty: nothing is kept. A disk that is full costs a warning.
void keep(const StandingOrders& orders, const std::string& directory);
// The defaults, if there is no such file. Throws InputError "PATH: why" when it is damaged.
StandingOrders kept_orders(const std::string& directory);

}  // namespace sectio
