#include "common/policy/linear/radial_basis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace treeroll {
namespace {

std::vector<double> radial_values(const RadialBasis& basis, double input) {
  std::vector<double> values(static_cast<std::size_t>(basis.size()));
  EXPECT_EQ(basis.values(input, values), 0);
  return values;
}

TEST(RadialBasisTest, AreGaussiansAsFarApartAsTheyAreWideNormalised) {
  const RadialBasis basis(4, 1, 4);  // centres at 1, 2, 3, 4
  const double near = std::exp(-.5), far = std::exp(-2), farthest = std::exp(-4.5);
  const double sum = 1 + near + far + farthest;
  const std::vector<double> values = radial_values(basis, 1);
  EXPECT_NEAR(values[0], 1 / sum, 1e-15);
  EXPECT_NEAR(values[1], near / sum, 1e-15);
  EXPECT_NEAR(values[2], far / sum, 1e-15);
  EXPECT_NEAR(values[3], farthest / sum, 1e-15);
}

TEST(RadialBasisTest, SumToOneAndStayBeyondTheirRange) {
  const RadialBasis basis(64, -2, 7);
  for (const double input : {-2., -1.3, 0., 3.33, 7.}) {
    double sum = 0;
    for (const double value : radial_values(basis, input)) sum += value;
    EXPECT_NEAR(sum, 1, 1e-14);
  }
  EXPECT_EQ(radial_values(basis, -1e300), radial_values(basis, -2));
  EXPECT_EQ(radial_values(basis, 1e300), radial_values(basis, 7));
}

TEST(RadialBasisTest, AreTheSameFromEitherEnd) {
  const RadialBasis basis(5, 0, 1);
  const std::vector<double> ahead = radial_values(basis, .2);
  const std::vector<double> back = radial_values(basis, .8);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(ahead[i], back[4 - i], 1e-14);
}

}  // namespace
}  // namespace treeroll
