#include "common/mixture/mixture_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/settings/settings_reader.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

Gmm read(const std::string& text, json* resolved_out = nullptr,
         std::optional<std::array<double, 2>> range = {}) {
  const json table = json::parse(text);
  json resolved;
  SettingsReader reader(table, "goal", resolved);
  Gmm gmm = read_mixture(reader, range);
  reader.finish();
  if (resolved_out) *resolved_out = resolved;
  return gmm;
}

std::string error_of(const std::string& text) {
  try {
    read(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

Eigen::MatrixXd covariance(double a, double b, double c) {
  return (Eigen::MatrixXd(2, 2) << a, b, b, c).finished();
}

TEST(MixtureSettingsTest, BuildsCovariancesFromZetaAndPsi) {
  const Gmm gmm = read(R"({"means": [[1, 2], [3, 4]], "deviations": [[2, 3], [4, 5]],
                           "psi": [0.5, -1], "priors": [1, 3]})");
  EXPECT_LT(test::distance(gmm, Gmm(1, {{1, Eigen::Vector2d(1, 2), covariance(4, 1, 9.25)},
                                        {3, Eigen::Vector2d(3, 4), covariance(16, -4, 26)}})),
            1e-14);
}

TEST(MixtureSettingsTest, SpacesComponentsEquallyOverARange) {
  const Gmm expected(1, {{.5, Eigen::Vector2d(1, 7), covariance(1, 0, 1)},
                         {.5, Eigen::Vector2d(3, 8), covariance(1, 0, 1)}});
  const std::string text = R"("outputs": [7, 8], "deviations": [1, 1]})";
  EXPECT_EQ(test::distance(read(R"({"range": [0, 4], )" + text), expected), 0);
  EXPECT_EQ(test::distance(read("{" + text, nullptr, {{0., 4.}}), expected), 0);
}

TEST(MixtureSettingsTest, ReadsAnyCovarianceAndSeveralInputs) {
  const Gmm gmm = read(R"({"inputs": 2, "means": [[1, 2, 3]],
                           "covariances": [[2, 0.1, 3, 0.2, 0.3, 4]]})");
  EXPECT_EQ(gmm.input_dim(), 2);
  EXPECT_EQ(gmm[0].covariance,
            (Eigen::MatrixXd(3, 3) << 2, .1, .2, .1, 3, .3, .2, .3, 4).finished());
  const Gmm two = read(R"({"inputs": 2, "means": [1, 2, 3], "deviations": [1, 1, 1],
                           "psi": [-5, 6]})");
  EXPECT_EQ(two[0].covariance.row(2), Eigen::RowVector3d(-5, 6, 62));
}

TEST(MixtureSettingsTest, ResolvesToSettingsOfTheSameMixture) {
  json resolved;
  const Gmm gmm =
      read(R"({"range": [0, 4], "outputs": [[7], [8]], "deviations": [1, 1]})", &resolved);
  json again;
  EXPECT_EQ(test::distance(read(resolved.dump(), &again), gmm), 0);
  EXPECT_EQ(again, resolved);
}

TEST(MixtureSettingsTest, RefusesWhatGivesNoMixtureNamingTheKey) {
  const std::pair<const char*, const char*> cases[] = {
      {"{}", "goal.means: is required"},
      {R"({"means": [[1, 2]]})", "goal.deviations: is required"},
      {R"({"means": [[1, 2], [3]], "deviations": [1, 1]})", "goal.means"},
      {R"({"outputs": [1, 2], "deviations": [1, 1]})", "goal.range: is required"},
      {R"({"outputs": [1, 2], "range": [2, 1], "deviations": [1, 1]})", "must begin before"},
      {R"({"outputs": [1], "inputs": 2, "deviations": [1, 1]})", "needs `inputs` to be 1"},
      {R"({"outputs": [1, 2], "means": [[1, 2]], "range": [0, 1], "deviations": [1, 1]})",
       "goal.means = [[1,2]]: unknown key"},
      {R"({"inputs": 2, "means": [[1, 2]], "deviations": [1, 1]})", "2 inputs and at least one"},
      {R"({"means": [[1, 2]], "deviations": [1, 0]})", "goal.deviations"},
      {R"({"means": [[1, 2]], "deviations": [1, 1, 1]})", "must hold 2 numbers"},
      {R"({"means": [[1, 2]], "deviations": [1, 1], "psi": [1, 2]})", "one for each of the 1"},
      {R"({"means": [[1, 2]], "deviations": [1, 1], "priors": [0]})", "gives no mixture"},
      {R"({"means": [[1, 2]], "deviations": [1, 1], "priors": [1, 1]})", "must hold 1 numbers"},
      {R"({"means": [[1, 2]], "covariances": [[1, 2, 1]]})", "goal.covariances = [[1,2,1]]"},
      {R"({"means": [[1, 2]], "covariances": [[1, 0, 1]], "psi": [1]})", "goal.psi"},
      {R"({"means": [[1e60, 2]], "deviations": [1, 1]})", "goal.means"},
  };
  for (const auto& [text, message] : cases) {
    EXPECT_THAT(error_of(text), HasSubstr(message)) << text;
  }
}

}  // namespace
}  // namespace treeroll
