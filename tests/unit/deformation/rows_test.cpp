#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "sim_server/deformation/max_tree.h"
#include "sim_server/deformation/spring_rows.h"
#include "tests/support/random.h"

namespace sectio::deformation_test {
namespace {

using Model = std::map<VertexId, std::pair<VertexRow, std::vector<HalfEdge>>>;

std::pair<VertexRow, std::vector<HalfEdge>> random_row(test::Random& random, std::uint32_t vertices) {
  std::uniform_real_distribution<float> number(0.1f, 1.0f);
  VertexRow row{Vec3f(number(random), number(random), number(random)), number(random), number(random), number(random)};
  std::vector<HalfEdge> half_edges(3 + random() % 15);
  for (HalfEdge& e : half_edges) {
    e = {static_cast<VertexId>(random() % vertices), number(random), number(random)};
  }
  return {row, half_edges};
}

void expect_same(const SpringRows& rows, const Model& model) {
  ASSERT_EQ(rows.row_count(), model.size());
  std::size_t lanes = 0;
  for (const SpringSlice& slice : rows.slices()) lanes += slice.count;
  EXPECT_EQ(lanes, model.size());
  for (const auto& [v, content] : model) {
    ASSERT_TRUE(rows.contains(v));
    EXPECT_EQ(rows.row(v), content.first);
    ASSERT_EQ(rows.degree(v), content.second.size());
    for (std::uint32_t n = 0; n < rows.degree(v); ++n) EXPECT_EQ(rows.half_edge(v, n), content.second[n]);
  }
}

TEST(SpringRows, behave_like_a_map_under_random_changes) {
  test::Random random(1);
  constexpr std::uint32_t kVertices = 700;
  Model model;
  std::vector<std::uint32_t> degrees(kVertices, kNone);
  for (VertexId v = 0; v < kVertices; v += 1 + static_cast<VertexId>(random() % 2)) {
    model[v] = random_row(random, kVertices);
    degrees[v] = static_cast<std::uint32_t>(model[v].second.size());
  }
  SpringRows rows;
  rows.layout(degrees);
  for (const auto& [v, content] : model) rows.set(v, content.first, content.second);
  expect_same(rows, model);
  for (int n = 0; n < 3000; ++n) {
    const VertexId v = static_cast<VertexId>(random() % (kVertices + 300));
    if (random() % 3 == 0) {
      rows.remove(v);
      model.erase(v);
    } else {
      model[v] = random_row(random, kVertices);
      rows.set(v, model[v].first, model[v].second);
    }
    if (n % 500 == 0) expect_same(rows, model);
  }
  expect_same(rows, model);
  EXPECT_GT(rows.overflow_row_count(), 0u);
  rows.compact();
  EXPECT_EQ(rows.overflow_row_count(), 0u);
  expect_same(rows, model);
}

TEST(SpringRows, do_not_grow_when_the_same_rows_come_and_go) {
  test::Random random(2);
  SpringRows rows;
  rows.layout(std::vector<std::uint32_t>(64, 6));
  const auto once = [&] {
    for (VertexId v = 50; v < 90; ++v) {
      const auto [row, half_edges] = random_row(random, 64);
      rows.set(v, row, half_edges);
    }
    for (VertexId v = 64; v < 90; ++v) rows.remove(v);
  };
  for (int n = 0; n < 50; ++n) once();
  const std::size_t columns = rows.columns().size();
  for (int n = 0; n < 1000; ++n) once();
  EXPECT_LE(rows.columns().size(), 2 * columns);
}

TEST(SpringRows, fill_their_slices) {
  test::Random random(3);
  std::vector<std::uint32_t> degrees(5000);
  std::size_t half_edges = 0;
  for (std::uint32_t& d : degrees) half_edges += d = 4 + static_cast<std::uint32_t>(random() % 5);
  SpringRows rows;
  rows.layout(degrees);
  EXPECT_LT(static_cast<double>(rows.columns().size()) * kLanes, 1.06 * static_cast<double>(half_edges));
}

TEST(MaxTree, knows_the_greatest) {
  test::Random random(4);
  std::vector<double> values;
  MaxTree tree;
  EXPECT_EQ(tree.max(), 0);
  for (int n = 0; n < 2000; ++n) {
    const std::size_t i = random() % std::min<std::size_t>(500, values.size() + 2);
    if (i >= values.size()) values.resize(i + 1, 0);
    values[i] = static_cast<double>(random() % 1000);
    tree.set(i, values[i]);
    ASSERT_EQ(tree.max(), *std::max_element(values.begin(), values.end()));
  }
}

}  // namespace
}  // namespace sectio::deformation_test
