#include "common/core/time_digest.h"

#include <gtest/gtest.h>

#include <vector>

#include "common/core/report_figures.h"
#include "tests/support/random.h"

namespace sectio::core_test {
namespace {

TEST(TimeDigest, has_the_quantiles_of_all_that_it_was_given) {
  test::Random random(7);
  std::lognormal_distribution<> times_s(std::log(2e-4), 1.5);
  TimeDigest digest;
  std::vector<double> all;
  double total_s = 0;
  for (int i = 0; i < 200'000; ++i) {
    all.push_back(times_s(random));
    digest.add(all.back());
    total_s += all.back();
  }
  for (const double q : {0.0, 0.01, 0.5, 0.99, 1.0}) EXPECT_NEAR(digest.quantile(q) / quantile(all, q), 1, 0.01) << q;
  EXPECT_DOUBLE_EQ(digest.total_s(), total_s);
  EXPECT_EQ(digest.count(), 200'000u);
}

TEST(TimeDigest, takes_any_duration) {
  TimeDigest digest;
  EXPECT_EQ(digest.quantile(0.5), 0);
  for (const double time_s : {0.0, -1.0, 1e-300, 1e300, HUGE_VAL}) digest.add(time_s);
  EXPECT_LT(digest.quantile(0), 2e-8);
  EXPECT_GT(digest.quantile(1), 1000);
}

}  // namespace
}  // namespace sectio::core_test
