#include "common/numbers/elementary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "common/numbers/elementary_kernels.h"
#include "common/numbers/random_stream.h"

namespace treeroll {
namespace {

/// Distance from the true value in units of its last place; x87's 64-bit mantissa is exact enough.
double ulps(double ours, long double truth) {
  const double magnitude = std::abs(static_cast<double>(truth));
  const double unit = magnitude < std::numeric_limits<double>::min()
                          ? std::numeric_limits<double>::denorm_min()
                          : std::ldexp(1., std::ilogb(magnitude) - 52);
  return static_cast<double>(std::abs(ours - truth) / unit);
}

void expect_accurate(double x) {
  const elementary::SinCos both = elementary::sin_cos(x);
  EXPECT_LT(ulps(both.sin, std::sin(static_cast<long double>(x))), 1) << "sin " << x;
  EXPECT_LT(ulps(both.cos, std::cos(static_cast<long double>(x))), 1) << "cos " << x;
  EXPECT_EQ(elementary::sin(x), both.sin);
  EXPECT_EQ(elementary::cos(x), both.cos);
}

TEST(ElementaryTest, IsLessThanAnUlpFromTheTrueValue) {
  RandomStream random(1, 0, 0, RandomPurpose::kPopulation);
  for (int i = 0; i < 200'000; ++i) {
    const double u = 2 * random.next_uniform() - 1;
    expect_accurate(4 * u);
    expect_accurate(2048 * u);
    expect_accurate(1e9 * u);
    for (const double x : {u, -745 * std::abs(u), 708 * u}) {
      EXPECT_LT(ulps(elementary::exp(x), std::exp(static_cast<long double>(x))), 1.01) << x;
    }
    const double y = std::exp(50 * u);
    EXPECT_LT(ulps(elementary::log(y), std::log(static_cast<long double>(y))), 1.01) << y;
    EXPECT_LT(ulps(elementary::atan2(u, .3), std::atan2<long double>(u, .3)), 1.01);
  }
}

/// Where the reduction cancels most: the doubles next to multiples of pi / 2.
TEST(ElementaryTest, IsAccurateNextToMultiplesOfAQuarterTurn) {
  for (int quarter = -1300; quarter <= 1300; ++quarter) {
    const auto at = static_cast<double>(quarter * (std::numbers::pi_v<long double> / 2));
    for (const double x : {at, std::nextafter(at, 1e9), std::nextafter(at, -1e9)}) {
      expect_accurate(x);
    }
  }
}

TEST(ElementaryTest, HandlesTheEndsOfTheRange) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(elementary::exp(-800), 0);
  EXPECT_EQ(elementary::exp(-kInfinity), 0);
  EXPECT_EQ(elementary::exp(0), 1);
  EXPECT_EQ(elementary::exp(-745), std::numeric_limits<double>::denorm_min());
  EXPECT_TRUE(std::isfinite(elementary::exp(709.78)));
  EXPECT_EQ(elementary::exp(710), kInfinity);
  EXPECT_EQ(elementary::exp(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(elementary::exp(kNan)));
  EXPECT_TRUE(std::isnan(elementary::sin(kNan)));
  EXPECT_TRUE(std::isnan(elementary::cos(kInfinity)));
  EXPECT_EQ(elementary::sin(0), 0);
  EXPECT_EQ(elementary::cos(0), 1);
  EXPECT_TRUE(std::isinf(elementary::log(0)));
  EXPECT_TRUE(std::isnan(elementary::log(-1)));
}

/// Numbers that must never change: results of studies follow from them.
TEST(ElementaryTest, GivesTheBitsItAlwaysGave) {
  std::uint64_t sum = 0;
  for (int i = -5000; i <= 5000; ++i) {
    const double x = i * .1234567;
    for (const double number : {elementary::sin(x), elementary::cos(x), elementary::exp(x)}) {
      sum = sum * 0x9e3779b97f4a7c15u + lanes::bits_as<std::uint64_t>(number);
    }
  }
  EXPECT_EQ(sum, 0x884136bf31cf3caeu) << std::hex << sum;
}

/// The wider ones are tested where they are used: they need the processor's instructions.
TEST(ElementaryTest, GivesTheSameBitsInALane) {
  using V = lanes::Double2;
  RandomStream random(2, 0, 0, RandomPurpose::kPopulation);
  for (int i = 0; i < 100'000; ++i) {
    const double a = 2000 * (2 * random.next_uniform() - 1);
    const double b = 7 * random.next_normal();
    V sin{}, cos{};
    elementary::kernel::sin_cos(V{a, b}, sin, cos);
    const V exp = elementary::kernel::exp(V{b, a});
    EXPECT_EQ(sin[0], elementary::sin(a));
    EXPECT_EQ(cos[0], elementary::cos(a));
    EXPECT_EQ(sin[1], elementary::sin(b));
    EXPECT_EQ(cos[1], elementary::cos(b));
    EXPECT_EQ(exp[0], elementary::exp(b));
    EXPECT_EQ(exp[1], elementary::exp(a));
  }
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const V exp = elementary::kernel::exp(V{kNan, -kNan});
  EXPECT_TRUE(std::isnan(exp[0]) && std::isnan(exp[1]));
}

}  // namespace
}  // namespace treeroll
