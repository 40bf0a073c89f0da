#include "sim_server/net/standing_orders.h"

#include <fstream>
#include <iterator>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/log.h"
#include "common/core/write_file.h"

namespace sectio {
namespace {

constexpr const char* kText = "speed %lf\npaused %d\nfrozen_tools %u\n";

std::string path_in(const std::string& directory) {
  return directory + "/orders";
}

}  // namespace

void keep(const StandingOrders& orders, const std::string& directory) {
  if (directory.empty()) return;
  const std::string text = formatted("speed %.17g\npaused %d\nfrozen_tools %u\n", orders.speed,
                                     orders.is_paused ? 1 : 0, orders.frozen_tools);
  try {
    write_file(path_in(directory), text);
  } catch (const InputError& error) {
    log_warning(std::string(error.what()) + ": a server that goes on after a crash won't know of this order");
  }
}

StandingOrders kept_orders(const std::string& directory) {
  if (directory.empty()) return {};
  std::ifstream file(path_in(directory));
  if (!file) return {};
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  StandingOrders orders;
  int paused = 0;
  const bool is_whole = std::sscanf(text.c_str(), kText, &orders.speed, &paused, &orders.frozen_tools) == 3;
  if (!is_whole || !(orders.speed >= 0.01 && orders.speed <= 10))
    throw InputError(path_in(directory) + ": damaged: nobody knows whether the session was paused, or at which speed");
  orders.is_paused = paused != 0;
  return orders;
}

}  // namespace sectio
