#include "common/core/shared_pages.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace sectio::core_test {
namespace {

using Pages = SharedPages<int, 8>;

TEST(SharedPages, is_a_vector) {
  test::Random64 random(3);
  std::vector<int> vector;
  Pages pages;
  for (int k = 0; k < 5000; ++k) {
    switch (random() % 4) {
      case 0:
        if (!vector.empty()) vector.pop_back(), pages.pop_back();
        break;
      case 1:
        if (!vector.empty()) {
          const std::size_t at = random() % vector.size();
          vector[at] = pages.edit(at) = k;
        }
        break;
      case 2:
        if (k % 50 == 0) {
          const std::size_t count = random() % 60;
          vector.resize(count, k), pages.resize(count, k);
        }
        break;
      default:
        vector.push_back(k), pages.push_back(k);
    }
    ASSERT_EQ(pages.size(), vector.size());
    ASSERT_TRUE(std::ranges::equal(pages, vector)) << k;
  }
}

TEST(SharedPages, copies_go_their_own_ways) {
  test::Random64 random(5);
  std::vector<std::vector<int>> vectors{{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}};
  std::vector<Pages> copies{Pages(std::span<const int>(vectors[0]))};
  for (int k = 0; k < 3000; ++k) {
    const std::size_t which = random() % copies.size();
    if (k % 100 == 0 && copies.size() < 20) {
      vectors.push_back(std::vector<int>(vectors[which]));
      copies.push_back(Pages(copies[which]));
    } else if (random() % 2 == 0 && !vectors[which].empty()) {
      const std::size_t at = random() % vectors[which].size();
      vectors[which][at] = copies[which].edit(at) = k;
    } else if (random() % 3 == 0 && !vectors[which].empty()) {
      vectors[which].pop_back(), copies[which].pop_back();
    } else {
      vectors[which].push_back(k), copies[which].push_back(k);
    }
    for (std::size_t c = 0; c < copies.size(); ++c) ASSERT_TRUE(std::ranges::equal(copies[c], vectors[c])) << k;
  }
}

TEST(SharedPages, reading_copies_nothing) {
  Pages base;
  for (int k = 0; k < 100; ++k) base.push_back(k);
  const Pages draft = base;
  for (std::size_t k = 0; k < 100; ++k) EXPECT_EQ(&base[k], &draft[k]);
  base.edit(50) = 7;
  EXPECT_EQ(draft[50], 50);
  EXPECT_EQ(&base[0], &draft[0]) << "one page is copied";
}

}  // namespace
}  // namespace sectio::core_test
