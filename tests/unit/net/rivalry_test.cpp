#include "sim_server/net/rivalry.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <random>

namespace sectio::net_test {
namespace {

// Two servers, the second begun so much later, and messages of each to the other, late at random.
struct Race {
  double head_start_s = 0;
  bool first_has_lower_epoch = true;
  double least_late_s = 0.001, most_late_s = 0.5;

  // Left 20 s later: 1, 2, both (3) or none (0).
  int left(unsigned seed) const {
    test::Random random(seed);
    std::uniform_real_distribution late_s(least_late_s, most_late_s);
    Rivalry first, second;  // each knows the other
    bool is_first_there = true, is_second_there = true;
    for (double now_s = 0; now_s < head_start_s + 20; now_s += 0.01) {
      const double first_s = now_s, second_s = std::max(0.0, now_s - head_start_s);
      const auto sent = [&](double begun_s) { return now_s - late_s(random) - begun_s; };
      const double from_second_s = sent(head_start_s), from_first_s = sent(0);
      if (is_second_there && from_second_s > 0) first.hear(from_second_s, first_s, now_s);
      if (is_first_there && from_first_s > 0 && now_s > head_start_s - 0.1) second.hear(from_first_s, second_s, now_s);
      const bool first_goes = first.gives_way(first_s, !first_has_lower_epoch, now_s);
      const bool second_goes = now_s > head_start_s - 0.1 && second.gives_way(second_s, first_has_lower_epoch, now_s);
      is_first_there = is_first_there && !(first_goes && is_second_there && from_second_s > 0);
      is_second_there = is_second_there && !(second_goes && is_first_there && from_first_s > 0);
    }
    return (is_first_there ? 1 : 0) + (is_second_there ? 2 : 0);
  }
};

TEST(Rivalry, one_of_two_servers_stays_and_it_is_the_first_by_a_head_start) {
  for (const double head_start_s : {0.0, 0.05, 0.15, 0.199, 0.2, 0.201, 0.3, 0.5, 0.9, 1.0, 1.1, 3.0, 60.0})
    for (const bool first_has_lower_epoch : {true, false})
      for (const double most_late_s : {0.01, 0.3, 2.0})
        for (unsigned seed = 1; seed <= 20; ++seed) {
          const int left = Race{head_start_s, first_has_lower_epoch, 0.001, most_late_s}.left(seed);
          const auto where = testing::Message()
                             << head_start_s << " s ahead, messages up to " << most_late_s << " s late, seed " << seed
                             << ", lower epoch: first? " << first_has_lower_epoch;
          ASSERT_TRUE(left == 1 || left == 2) << where << ": " << left;
          if (head_start_s > 0.25 || first_has_lower_epoch) {
            ASSERT_EQ(left, 1) << where;
          }
        }
}

}  // namespace
}  // namespace sectio::net_test
