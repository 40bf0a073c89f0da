#include "common/messages/session_servers.h"

#include <gtest/gtest.h>

namespace sectio::net_test {
namespace {

constexpr std::uint64_t kLiver = first_epoch(5), kKidney = first_epoch(7);
constexpr double kGone_s = SessionServers::kSilence_s + 0.1;

TEST(SessionServers, a_session_ends_with_its_only_server) {
  SessionServers servers;
  EXPECT_FALSE(servers.all_ended(0));
  servers.hear(kLiver, 0);
  EXPECT_FALSE(servers.all_ended(100)) << "it may come back";
  servers.end(kLiver);
  EXPECT_TRUE(servers.all_ended(100));
  servers.hear(kLiver, 100);  // a late message
  EXPECT_TRUE(servers.all_ended(100));
}

TEST(SessionServers, a_session_goes_on_with_each_server_that_speaks) {
  for (const auto& [first, second] : {std::pair(kLiver, kKidney), std::pair(kKidney, kLiver)}) {
    SessionServers servers;
    servers.hear(first, 0);
    servers.hear(second, 0);
    servers.end(first);
    EXPECT_FALSE(servers.all_ended(1));
    servers.hear(second, 60);
    EXPECT_FALSE(servers.all_ended(61));
    EXPECT_TRUE(servers.all_ended(60 + kGone_s)) << "it has died";
    servers.hear(second, 70);
    EXPECT_FALSE(servers.all_ended(71)) << "or was halted";
    servers.end(second);
    EXPECT_TRUE(servers.all_ended(71));
  }
}

TEST(SessionServers, the_end_of_a_server_whose_session_another_one_has_is_none) {
  SessionServers servers;
  servers.hear(kLiver, 0);
  servers.hear(kLiver + 2, 1);
  servers.end(kLiver);
  EXPECT_FALSE(servers.all_ended(100));
  servers.end(kLiver + 2);
  EXPECT_TRUE(servers.all_ended(100));
}

TEST(SessionServers, no_more_are_kept_than_there_may_be) {
  SessionServers servers;
  servers.hear(kLiver, 0);
  for (std::uint64_t i = 0; i < 2 * SessionServers::kMost; ++i) servers.end(first_epoch(100 + i));
  EXPECT_FALSE(servers.all_ended(1));
  servers.hear(kLiver, 100);
  EXPECT_FALSE(servers.all_ended(101));
}

}  // namespace
}  // namespace sectio::net_test
