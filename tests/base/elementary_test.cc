#include "common/base/elementary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace treeroll {
namespace {

// The C library is accurate to an ulp too, so the two may differ by two.
void expect_close(double ours, double theirs) {
  EXPECT_NEAR(ours, theirs, 2 * std::numeric_limits<double>::epsilon() * std::abs(theirs) + 1e-300);
}

TEST(ElementaryTest, AgreesWithTheCLibraryToTwoUlps) {
  for (double x = -40; x <= 40; x += .00917) {
    expect_close(elementary::sin(x), std::sin(x));
    expect_close(elementary::cos(x), std::cos(x));
    expect_close(elementary::exp(x), std::exp(x));
    if (x > 0) expect_close(elementary::log(x), std::log(x));
    expect_close(elementary::atan2(x, 3), std::atan2(x, 3));
    expect_close(elementary::atan2(3, x), std::atan2(3, x));
  }
}

TEST(ElementaryTest, HandlesTheEndsOfTheRange) {
  EXPECT_EQ(elementary::exp(-800), 0);
  EXPECT_TRUE(std::isinf(elementary::exp(800)));
  EXPECT_TRUE(std::isinf(elementary::log(0)));
  EXPECT_TRUE(std::isnan(elementary::log(-1)));
}

}  // namespace
}  // namespace treeroll
