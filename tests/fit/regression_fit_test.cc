#include "learner/fit/regression_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/mixture/gmr.h"
#include "learner/fit/demonstration.h"
#include "learner/fit/fit_tree.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using ::testing::HasSubstr;

FitSettings swing_up_settings() {
  FitSettings settings;
  settings.em.regularisation = Eigen::Vector2d(1e-3, 1);
  return settings;
}

Gmm em(int num_components) {
  return fit_flat(demonstrate({}), num_components, swing_up_settings()).finest();
}

/// Inputs at random, outputs as the regression of `gmm` gives them.
Eigen::MatrixXd data_of(const Gmm& gmm, test::RandomMixture& random, int num_samples) {
  Eigen::MatrixXd data(gmm.dim(), num_samples);
  const Gmr gmr(gmm);
  for (int n = 0; n < num_samples; ++n) {
    const Eigen::VectorXd input = 3 * random.vector(gmm.input_dim());
    data.col(n) << input, gmr.regress(input);
  }
  return data;
}

TEST(RegressionFitTest, MeetsTheSwingUpsDemonstrationUntilItIsCloseEnough) {
  const Eigen::MatrixXd data = demonstrate({});
  const auto error = [&](int num_components, double stop) {
    return relative_regression_error(
        refine_regression(em(num_components), data, {.stop_relative_error = stop}), data);
  };
  EXPECT_NEAR(relative_regression_error(em(4), data), .2926, .002);  // 1.70 m/s^2 of 5.82
  EXPECT_NEAR(error(2, .02), .769, .005);
  EXPECT_NEAR(error(3, .02), .0711, .002);
  EXPECT_NEAR(error(4, .02), .0197, 4e-4);  // stopped
  EXPECT_LT(error(4, 0), .0015);            // to the end
  EXPECT_LT(error(5, 0), .0005);
}

TEST(RegressionFitTest, StopsBeforeGaussiansCancelOneAnother) {
  const Eigen::MatrixXd data = demonstrate({});
  const auto largest = [&](double stop) {
    double most = 0;
    const Gmm refined = refine_regression(em(4), data, {.stop_relative_error = stop});
    for (const Component& component : refined.components()) {
      most = std::max(most, std::abs(component.mean[1]));
    }
    return most;
  };
  EXPECT_LT(largest(.02), 40);  // m/s^2; the demonstration has 20
  EXPECT_GT(largest(0), 100);
}

/// With inputs and outputs of several dimensions, whose Jacobian has every block: where the data
/// are a regression, it is found again.
TEST(RegressionFitTest, FindsARegressionAgain) {
  for (const auto& [num_inputs, dim] : {std::pair{1, 2}, {1, 3}, {2, 3}, {3, 5}}) {
    test::RandomMixture random(static_cast<std::uint32_t>(10 * num_inputs + dim));
    const Gmm true_one = random.gmm(num_inputs, dim, 2);
    const Eigen::MatrixXd data = data_of(true_one, random, 150);
    std::vector<Component> components = true_one.components();
    for (Component& component : components) {
      component.prior *= 1.2;
      component.mean += .1 * random.vector(dim);
      component.covariance *= 1.1;
    }
    const Gmm start(num_inputs, components);
    EXPECT_GT(relative_regression_error(start, data), .01);
    const Gmm fit = refine_regression(start, data, {.stop_relative_error = 1e-7});
    EXPECT_LT(relative_regression_error(fit, data), 1e-4) << num_inputs << " inputs of " << dim;
  }
}

TEST(RegressionFitTest, LeavesWhatARegressionDoesNotKnow) {
  const Gmm before = em(4);
  const Gmm after = refine_regression(before, demonstrate({}), {});
  double sum_before = 0;
  double sum_after = 0;
  for (int k = 0; k < 4; ++k) {
    const auto around_line = [](const Component& c) {
      return c.covariance(1, 1) - c.covariance(0, 1) * c.covariance(0, 1) / c.covariance(0, 0);
    };
    EXPECT_NEAR(around_line(after[k]), around_line(before[k]), 1e-9 * after[k].covariance(1, 1));
    sum_before += before[k].prior;
    sum_after += after[k].prior;
  }
  EXPECT_NEAR(sum_after, sum_before, 1e-12);
}

TEST(RegressionFitTest, TakesOutputsInAnyUnit) {
  Eigen::MatrixXd data = demonstrate({});
  const Gmm plain = refine_regression(em(3), data, {});
  data.row(1) *= 1024;
  FitSettings settings = swing_up_settings();
  settings.em.regularisation[1] *= 1024. * 1024;
  settings.initial_output_deviation *= 1024;
  const Gmm scaled = refine_regression(fit_flat(data, 3, settings).finest(), data, {});
  for (const double time_s : {0., .7, 1.1, 2.2}) {
    EXPECT_NEAR(Gmr(scaled).regress(time_s) / 1024, Gmr(plain).regress(time_s), 1e-3);
  }
}

TEST(RegressionFitTest, RefusesAComponentWithoutWeight) {
  std::vector<Component> components = em(2).components();
  components[1].prior = 0;
  EXPECT_THROW(refine_regression(Gmm(1, components), demonstrate({}), {}), FitError);
}

TEST(RegressionFitTest, TheFinestLayerOfATreeMeetsTheDataToo) {
  const Eigen::MatrixXd data = demonstrate({});
  FitSettings settings = swing_up_settings();
  settings.refine.emplace();
  for (const TreeModel& tree : {fit_flat(data, 4, settings), fit_bottom_up(data, 2, 2, settings),
                                fit_top_down(data, 4, 2, settings)}) {
    EXPECT_LE(relative_regression_error(tree.finest(), data), .021);
    for (int k = 1; k < tree.num_components(1); ++k) {
      EXPECT_LT(tree.layer(1)[k - 1].mean[0], tree.layer(1)[k].mean[0]);
    }
  }
}

}  // namespace
}  // namespace treeroll
