#include "sim_server/session/stroke_log.h"

#include <gtest/gtest.h>

namespace sectio {
namespace {

Event at(std::uint64_t step, EventKind kind, std::uint32_t tool, std::string text = "") {
  return {step, kind, 0, tool, std::move(text)};
}

TEST(StrokeLog, has_the_beginning_the_end_and_its_reason) {
  StrokeLog log;
  log.add(at(5, EventKind::cut_ended, 0, "nothing had begun"));
  log.add(at(10, EventKind::penetrated, 0));
  log.add(at(12, EventKind::penetrated, 1));
  log.add(at(20, EventKind::cut_refused, 1, "no room"));
  log.add(at(30, EventKind::joined, 0));
  log.add(at(40, EventKind::cut_ended, 0, "it was lifted out"));
  log.add(at(50, EventKind::cut_ended, 0, "again"));
  log.add(at(60, EventKind::penetrated, 0));
  ASSERT_EQ(log.strokes().size(), 3u);
  EXPECT_EQ(log.strokes()[0].from_step, 10u);
  EXPECT_EQ(log.strokes()[0].to_step, 40u);
  EXPECT_EQ(log.strokes()[0].end, "it was lifted out");
  EXPECT_EQ(log.strokes()[1].to_step, 20u) << "refused, and nothing came after it";
  EXPECT_EQ(log.strokes()[1].end, "no room");
  EXPECT_EQ(log.strokes()[2].end, "");
  EXPECT_EQ(log.strokes()[2].to_step, 0u);
  log.add(at(61, EventKind::penetrated, 0));
  for (const std::uint64_t step : {70u, 71u}) log.add(at(step, EventKind::cut_ended, 0, "its jaws opened"));
  for (const std::size_t edge : {2u, 3u}) EXPECT_GT(log.strokes()[edge].to_step, 0u) << "scissors have two edges";
  for (int i = 0; i < 2000; ++i) log.add(at(100, EventKind::penetrated, 2));
  EXPECT_EQ(log.strokes().size(), StrokeLog::kMost);
}

}  // namespace
}  // namespace sectio
