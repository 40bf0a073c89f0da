#include "sim_server/net/standing_orders.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/core/error.h"

namespace sectio::net_test {
namespace {

TEST(StandingOrders, are_kept_and_damage_to_them_is_told) {
  const auto directory = std::filesystem::temp_directory_path() / ("orders." + std::to_string(::getpid()));
  std::filesystem::create_directories(directory);
  EXPECT_EQ(kept_orders(directory).speed, 1) << "none were given";
  keep({.speed = 0.25, .is_paused = true, .frozen_tools = 5}, directory);
  const StandingOrders kept = kept_orders(directory);
  EXPECT_EQ(kept.speed, 0.25);
  EXPECT_TRUE(kept.is_paused);
  EXPECT_EQ(kept.frozen_tools, 5u);
  for (const char* const text :
       {"", "speed 0.25\n", "speed 1e9\npaused 0\nfrozen_tools 0\n", "spend 1\npaused 0\nfrozen_tools 0\n"}) {
    std::ofstream(directory / "orders") << text;
    EXPECT_THROW(kept_orders(directory), InputError) << text;
  }
  std::filesystem::remove_all(directory);
}

}  // namespace
}  // namespace sectio::net_test
