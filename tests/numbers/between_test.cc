#include "common/numbers/between.h"

#include <gtest/gtest.h>

#include <vector>

namespace treeroll {
namespace {

const std::vector<double> kPlaces = {1, 2, 4};

TEST(BetweenTest, IsTheShareOfTheWayToTheNextPlace) {
  EXPECT_EQ(between(kPlaces, 1.25).after, 1U);
  EXPECT_EQ(between(kPlaces, 1.25).share, .25);
  EXPECT_EQ(between(kPlaces, 3.5).after, 2U);
  EXPECT_EQ(between(kPlaces, 3.5).share, .75);
}

TEST(BetweenTest, IsAtAPlaceToTheBitAndStaysBeyondTheEnds) {
  const double values[] = {.1, -.7, 1e17};
  for (const auto& [x, value] :
       {std::pair{1., .1}, {2., -.7}, {4., 1e17}, {-1e300, .1}, {1e300, 1e17}}) {
    const auto [after, share] = between(kPlaces, x);
    EXPECT_EQ((1 - share) * values[after - 1] + share * values[after], value) << x;
  }
}

}  // namespace
}  // namespace treeroll
