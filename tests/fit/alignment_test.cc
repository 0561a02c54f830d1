#include "learner/fit/alignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace treeroll {
namespace {

/// Samples of a movement that is at the place `phase(s)` at the share s of its duration.
Eigen::MatrixXd movement(double start_s, double duration_s, int num_samples,
                         const std::function<double(double)>& phase) {
  Eigen::MatrixXd data(3, num_samples);
  for (int n = 0; n < num_samples; ++n) {
    const double share = 1. * n / (num_samples - 1);
    const double p = phase(share);
    data.col(n) << start_s + duration_s * share, std::sin(5 * p), 10 * std::cos(3 * p);
  }
  return data;
}
double even(double s) { return s; }
/// Slow at first, then fast.
double late(double s) { return s * s; }

/// The largest distance in time between samples of one and the same place of a movement: sample n
/// of `one`, which is at late(s), and where the even one is there.
double misfit(const Eigen::MatrixXd& one, double start_s, double duration_s) {
  double worst = 0;
  for (Eigen::Index n = 0; n < one.cols(); ++n) {
    const double place = late(static_cast<double>(n) / static_cast<double>(one.cols() - 1));
    worst = std::max(worst, std::fabs(one(0, n) - (start_s + duration_s * place)));
  }
  return worst;
}

TEST(AlignmentTest, WithoutOneNothingChanges) {
  std::vector<Eigen::MatrixXd> all = {movement(0, 2, 20, even), movement(1, 3, 30, late)};
  const std::vector<Eigen::MatrixXd> before = all;
  align(all, Alignment::kNone);
  EXPECT_EQ(all, before);
}

TEST(AlignmentTest, ByDurationAllBeginAndEndTogetherAndOutputsStay) {
  std::vector<Eigen::MatrixXd> all = {movement(0, 2, 20, even), movement(1, 3, 30, late),
                                      movement(5, 4, 11, even)};
  const std::vector<Eigen::MatrixXd> before = all;
  align(all, Alignment::kDuration);
  for (std::size_t k = 0; k < all.size(); ++k) {
    EXPECT_NEAR(all[k](0, 0), 2, 1e-12);
    EXPECT_NEAR(all[k](0, all[k].cols() - 1), 5, 1e-12);
    EXPECT_EQ(all[k].bottomRows(2), before[k].bottomRows(2));
  }
  // One movement at three speeds has become one movement.
  EXPECT_NEAR(all[2](0, 5), all[2](0, 0) + 1.5, 1e-12);
}

TEST(AlignmentTest, WarpingBringsTogetherWhatLooksAlike) {
  std::vector<Eigen::MatrixXd> all = {movement(0, 2, 201, even), movement(0, 1.9, 201, late),
                                      movement(0, 2.1, 151, late)};
  const std::vector<Eigen::MatrixXd> before = all;
  std::vector<Eigen::MatrixXd> by_duration = all;
  align(by_duration, Alignment::kDuration);
  align(all, Alignment::kDynamicTimeWarping);
  for (const std::size_t k : {1U, 2U}) {
    EXPECT_GT(misfit(by_duration[k], 0, 2), .3) << k;
    EXPECT_LT(misfit(all[k], 0, 2), .03) << k;  // a sample of the reference takes .01 s
    EXPECT_EQ(all[k].bottomRows(2), before[k].bottomRows(2));
    for (Eigen::Index n = 1; n < all[k].cols(); ++n) {
      EXPECT_GE(all[k](0, n), all[k](0, n - 1)) << "time does not go back";
    }
    EXPECT_NEAR(all[k](0, 0), 0, .011) << "both begin together";
    EXPECT_NEAR(all[k](0, all[k].cols() - 1), 2, .011) << "and end together";
  }
  EXPECT_EQ(all[0], by_duration[0]) << "the reference keeps its clock";
}

/// Sensors that are read in turn have no output in common: what lies between tells.
TEST(AlignmentTest, WarpingBringsTogetherWhatSensorsInTurnHaveSeen) {
  std::vector<Eigen::MatrixXd> all = {movement(0, 2, 201, even), movement(0, 2, 201, late)};
  for (Eigen::MatrixXd& one : all) {
    for (Eigen::Index n = 0; n < one.cols(); ++n) {
      one(1 + n % 2, n) = std::numeric_limits<double>::quiet_NaN();
    }
  }
  const Eigen::MatrixXd before = all[1];
  EXPECT_GT(misfit(before, 0, 2), .3);
  align(all, Alignment::kDynamicTimeWarping);
  EXPECT_LT(misfit(all[1], 0, 2), .05);
  EXPECT_TRUE((all[1].bottomRows(2).array().isNaN() == before.bottomRows(2).array().isNaN()).all())
      << "no sample is made up";
}

TEST(AlignmentTest, WhatIsAlikeAlreadyStaysSo) {
  const Eigen::MatrixXd one = movement(0, 2, 50, even);
  std::vector<Eigen::MatrixXd> all = {one, one, one};
  align(all, Alignment::kDynamicTimeWarping);
  for (const Eigen::MatrixXd& aligned : all) EXPECT_LT((aligned - one).norm(), 1e-12);
  // Nothing tells one rest from another.
  Eigen::MatrixXd rest = one;
  rest.bottomRows(2).setConstant(3);
  all = {rest, rest};
  align(all, Alignment::kDynamicTimeWarping);
  for (const Eigen::MatrixXd& aligned : all) EXPECT_LT((aligned - rest).norm(), 1e-12);
}

/// An output in other units changes nothing, up to the rounding of ties.
TEST(AlignmentTest, UnitsOfOutputsDoNotCount) {
  std::vector<Eigen::MatrixXd> metres = {movement(0, 2, 101, even), movement(0, 2, 101, late)};
  std::vector<Eigen::MatrixXd> millimetres = metres;
  for (Eigen::MatrixXd& one : millimetres) one.row(1) *= 1024;
  align(metres, Alignment::kDynamicTimeWarping);
  align(millimetres, Alignment::kDynamicTimeWarping);
  EXPECT_EQ(metres[1].row(0), millimetres[1].row(0));
}

TEST(AlignmentTest, CountsThePairsThatItCompares) {
  const std::vector<Eigen::MatrixXd> all = {movement(0, 2, 20, even), movement(0, 3, 30, late),
                                            movement(0, 4, 50, even)};
  EXPECT_EQ(warped_pairs(all, Alignment::kDynamicTimeWarping), 30. * 100);
  EXPECT_EQ(warped_pairs(all, Alignment::kDuration), 0);
}

}  // namespace
}  // namespace treeroll
