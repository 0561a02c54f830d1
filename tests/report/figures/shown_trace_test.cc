#include "learner/report/figures/shown_trace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace treeroll::report {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// Two columns, time and twice the time, with a pose whose only line begins at the time.
RolloutTrace trace_at(const std::vector<double>& times) {
  RolloutTrace trace{.columns = {"time_s", "x_m"},
                     .numbers = {},
                     .policy_inputs = {"time_s"},
                     .policy_outputs = {"x_m"},
                     .poses = {}};
  for (const double time : times) {
    trace.numbers.push_back(time);
    trace.numbers.push_back(2 * time);
    trace.poses.push_back({{time, 0, 1, 1}});
  }
  return trace;
}

TEST(ShownTraceTest, AThinnedTraceKeepsFirstAndLastRowAndTheirPoses) {
  const RolloutTrace thin = thinned(trace_at({0, 1, 2, 3, 4, 5, 6, 7, 8}), 3);
  EXPECT_THAT(thin.numbers, ElementsAre(0, 0, 4, 8, 8, 16));
  ASSERT_EQ(thin.poses.size(), 3);
  EXPECT_EQ(thin.poses[1][0][0], 4);
  EXPECT_THAT(thin.policy_outputs, ElementsAre("x_m"));
}

TEST(ShownTraceTest, AShortTraceStaysWhole) {
  EXPECT_THAT(thinned(trace_at({0, 1}), 10).numbers, ElementsAre(0, 0, 1, 2));
  EXPECT_THAT(thinned(trace_at({3}), 1).numbers, ElementsAre(3, 6));
  EXPECT_THAT(thinned(trace_at({}), 10).numbers, IsEmpty());
  EXPECT_THAT(thinned(RolloutTrace{}, 10).numbers, IsEmpty());
}

TEST(ShownTraceTest, OfSeveralRolloutsOnEndTheFirstIsShown) {
  EXPECT_THAT(thinned(trace_at({0, 1, 0, 1, 2}), 10).numbers, ElementsAre(0, 0, 1, 2));
}

TEST(ShownTraceTest, ColumnsAreFoundByName) {
  EXPECT_THAT(*column_of(trace_at({1, 2}), "x_m"), ElementsAre(2, 4));
  EXPECT_FALSE(column_of(trace_at({1, 2}), goal_of("x_m")));
}

TEST(ShownTraceTest, AnAxisHasItsUnitInBrackets) {
  EXPECT_EQ(axis_title("cart_acceleration_mps2"), "cart acceleration (m/s²)");
  EXPECT_EQ(axis_title("phi1_rate_radps"), "phi1 rate (rad/s)");
  EXPECT_EQ(axis_title("time_s"), "time (s)");
  EXPECT_EQ(axis_title("x"), "x");
  EXPECT_EQ(axis_title("s"), "s");
  EXPECT_EQ(axis_title("goal_x"), "goal x");
  EXPECT_EQ(axis_title(""), "");
}

}  // namespace
}  // namespace treeroll::report
