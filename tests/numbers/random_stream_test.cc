#include "common/numbers/random_stream.h"

#include <gtest/gtest.h>

#include <cmath>

namespace treeroll {
namespace {

RandomStream stream(std::uint64_t seed, std::uint32_t repetition, std::uint32_t rollout) {
  return RandomStream(seed, repetition, rollout, RandomPurpose::kPerturbation);
}

// Known answer of Random123's kat_vectors for philox4x64 with 10 rounds, zero key and counter.
TEST(RandomStreamTest, IsPhilox4x64With10Rounds) {
  RandomStream zero = stream(0, 0, 0);
  EXPECT_EQ(zero.next_bits(), 0x16554d9eca36314cULL);
  EXPECT_EQ(zero.next_bits(), 0xdb20fe9d672d0fdcULL);
  EXPECT_EQ(zero.next_bits(), 0xd7e772cee186176bULL);
  EXPECT_EQ(zero.next_bits(), 0x7e68b68aec7ba23bULL);
}

TEST(RandomStreamTest, IsAFunctionOfEachPartOfItsKey) {
  const std::uint64_t reference = stream(1, 2, 3).next_bits();
  EXPECT_EQ(stream(1, 2, 3).next_bits(), reference);
  EXPECT_NE(stream(9, 2, 3).next_bits(), reference);
  EXPECT_NE(stream(1, 9, 3).next_bits(), reference);
  EXPECT_NE(stream(1, 2, 9).next_bits(), reference);
  EXPECT_NE(RandomStream(1, 2, 3, RandomPurpose::kTaskSeed).next_bits(), reference);
}

// Moments of the standard normal: 0, 1, 0, 3. With n draws their standard errors are
// 1, sqrt 2, sqrt 15 and sqrt 96 over sqrt n; five of them are allowed.
TEST(RandomStreamTest, NormalsHaveTheMomentsOfTheStandardNormal) {
  constexpr int kDraws = 1'000'000;
  double sums[4] = {};
  for (int rollout = 0; rollout < kDraws / 10; ++rollout) {
    RandomStream draws = stream(7, 1, static_cast<std::uint32_t>(rollout));
    for (int i = 0; i < 10; ++i) {
      const double z = draws.next_normal();
      sums[0] += z;
      sums[1] += z * z;
      sums[2] += z * z * z;
      sums[3] += z * z * z * z;
    }
  }
  const double error = 5 / std::sqrt(static_cast<double>(kDraws));
  EXPECT_NEAR(sums[0] / kDraws, 0, error);
  EXPECT_NEAR(sums[1] / kDraws, 1, error * std::sqrt(2.));
  EXPECT_NEAR(sums[2] / kDraws, 0, error * std::sqrt(15.));
  EXPECT_NEAR(sums[3] / kDraws, 3, error * std::sqrt(96.));
}

TEST(RandomStreamTest, UniformsStayInsideTheOpenInterval) {
  RandomStream draws = stream(3, 0, 0);
  for (int i = 0; i < 100'000; ++i) {
    const double u = draws.next_uniform();
    ASSERT_GT(u, 0);
    ASSERT_LT(u, 1);
  }
}

}  // namespace
}  // namespace treeroll
