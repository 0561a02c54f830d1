#include "learner/fit/sufficient.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "learner/fit/relative_error.h"

namespace treeroll {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string refusal_of_sizes(const SizeRange& sizes, double error) {
  try {
    smallest_sufficient({.sizes = sizes, .what = "things"}, [&](int size) {
      if (size == 4) throw FitError("four have no fit");
      return Fitted<int>{size, error};
    });
  } catch (const FitError& refused) {
    return refused.what();
  }
  return "found";
}

TEST(SmallestSufficientTest, IsTheFirstThatComesCloseEnoughAndNoneIsFittedTwice) {
  std::vector<int> tried;
  const int size = smallest_sufficient({.sizes = {2, 2, 16}, .what = "things"}, [&](int number) {
    tried.push_back(number);
    return Fitted<int>{number, .7 / number};
  });
  EXPECT_EQ(size, 8);
  EXPECT_THAT(tried, ElementsAre(2, 4, 6, 8));
}

TEST(SmallestSufficientTest, PassesOverASizeThatHasNoFit) {
  const int size = smallest_sufficient({.sizes = {1, 1, 16}, .what = "things"}, [&](int number) {
    if (number < 5) throw FitError("too few");
    return Fitted<int>{number, 0};
  });
  EXPECT_EQ(size, 5);
}

TEST(SmallestSufficientTest, SaysHowCloseItCameOrWhyThereIsNoFit) {
  EXPECT_THAT(refusal_of_sizes({2, 2, 8}, .25),
              HasSubstr("of up to 8 things none come within 0.1"));
  EXPECT_THAT(refusal_of_sizes({2, 2, 8}, .25), HasSubstr("the best within 0.25: say how many"));
  EXPECT_THAT(refusal_of_sizes({4, 2, 4}, 0), HasSubstr("four have no fit"));
  // An error that is no number is not close.
  EXPECT_NE(refusal_of_sizes({2, 2, 8}, std::numeric_limits<double>::quiet_NaN()), "found");
}

TEST(RelativeRmsTest, CountsEachOutputInItsOwnUnitAndWhatIsThere) {
  Eigen::MatrixXd outputs(3, 4);
  outputs << 3, -3, 3, -3, 100, 100, std::numeric_limits<double>::quiet_NaN(), 100, 0, 0, 0, 0;
  Eigen::MatrixXd curve = outputs;
  curve(1, 2) = 7;  // missing: no error
  EXPECT_EQ(relative_rms(curve, outputs), 0);
  curve.row(0).array() += 3;
  EXPECT_NEAR(relative_rms(curve, outputs), std::sqrt(4. / 11), 1e-15);
  curve.row(1).array() += 100;
  curve.row(2).array() += 1;  // an output that is always 0 has the unit 1
  EXPECT_NEAR(relative_rms(curve, outputs), 1, 1e-15);
}

}  // namespace
}  // namespace treeroll
