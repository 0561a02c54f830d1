#include "common/mixture/mixture_settings.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "common/settings/settings_reader.h"

namespace treeroll {
namespace {

using Rows = std::vector<std::vector<double>>;

constexpr std::size_t kSettingComponentsMax = 64;
constexpr std::size_t kSettingDimMax = 32;
constexpr NumberRule kNumber{.min = -kGmmMagnitudeMax, .max = kGmmMagnitudeMax};
constexpr NumberRule kDeviation{.min = 1e-20, .max = 1e20};
constexpr NumberRule kPsi{.min = -1e20, .max = 1e20};

/// Means at the middles of equal parts of `range`, beside the given outputs.
Rows spaced_means(SettingsReader& mixture, std::optional<std::array<double, 2>> range) {
  std::optional<std::vector<double>> fallback;
  if (range) fallback = std::vector<double>(range->begin(), range->end());
  const std::vector<double> ends =
      mixture.numbers("range", kNumber, 2, 2, fallback,
                      {.meaning = "The components' inputs are the middles of equal parts of it"});
  if (!(ends[0] < ends[1])) mixture.refuse("range", "must begin before it ends");
  Rows means = mixture.rows(
      "outputs", kNumber, kSettingComponentsMax, 1, kSettingDimMax - 1, {},
      {.meaning = "In place of means, with one input: the mean outputs of each component",
       .example = "[[1], [-1]]"});
  for (std::size_t k = 0; k < means.size(); ++k) {
    const double share = (static_cast<double>(k) + .5) / static_cast<double>(means.size());
    means[k].insert(means[k].begin(), ends[0] + share * (ends[1] - ends[0]));
  }
  return means;
}

/// One row for each component, where one for all may have been given.
void need_row_each(SettingsReader& mixture, std::string_view key, Rows& rows, std::size_t count) {
  if (rows.size() == 1) rows.resize(count, rows[0]);
  if (rows.size() == count) return;
  mixture.refuse(key, fmt::format("must hold one list, or one for each of the {} components, and "
                                  "holds {}",
                                  count, rows.size()));
}

/// Covariances from their lower triangles.
std::vector<Eigen::MatrixXd> read_covariances(SettingsReader& mixture, Eigen::Index dim,
                                              std::size_t count) {
  const auto size = static_cast<std::size_t>(dim * (dim + 1) / 2);
  Rows rows =
      mixture.rows("covariances", kNumber, kSettingComponentsMax, size, size, {},
                   {.meaning = "In place of deviations and psi: the lower triangle of each "
                               "covariance, row by row; one list for all components, or one each",
                    .rule = "a list for each component, or one for all",
                    .example = "[[0.1, 0.0, 0.1]]"});
  need_row_each(mixture, "covariances", rows, count);
  std::vector<Eigen::MatrixXd> covariances;
  for (const std::vector<double>& row : rows) {
    Eigen::MatrixXd& covariance = covariances.emplace_back(dim, dim);
    std::size_t next = 0;
    for (Eigen::Index i = 0; i < dim; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) covariance(i, j) = covariance(j, i) = row[next++];
    }
  }
  return covariances;
}

/// Covariances L L^T from the diagonal of L and its block of outputs and inputs, (3-12).
std::vector<Eigen::MatrixXd> read_factors(SettingsReader& mixture, Eigen::Index dim,
                                          Eigen::Index input_dim, std::size_t count) {
  const auto size = static_cast<std::size_t>(dim);
  Rows deviations = mixture.rows(
      "deviations", kDeviation, kSettingComponentsMax, size, size, {},
      {.meaning =
           "The diagonal of L (3-12), inputs and outputs; one list for all components, or one each",
       .rule = "a list for each component, or one for all; each 1e-20 to 1e20",
       .example = "[[0.25, 0.3]]"});
  need_row_each(mixture, "deviations", deviations, count);
  const auto psi_size = static_cast<std::size_t>(input_dim * (dim - input_dim));
  Rows psi =
      mixture.rows("psi", kPsi, kSettingComponentsMax, psi_size, psi_size,
                   Rows{std::vector<double>(psi_size, 0.)},
                   {.meaning = "The block of L (3-12) that couples outputs to inputs, inputs x "
                               "outputs numbers; one list for all components, or one each",
                    .otherwise = "0",
                    .rule = "a list for each component, or one for all"});
  need_row_each(mixture, "psi", psi, count);
  std::vector<Eigen::MatrixXd> covariances;
  for (std::size_t k = 0; k < count; ++k) {
    Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(dim, dim);
    for (Eigen::Index i = 0; i < dim; ++i) {
      factor(i, i) = deviations[k][static_cast<std::size_t>(i)];
    }
    std::size_t next = 0;
    for (Eigen::Index i = input_dim; i < dim; ++i) {
      for (Eigen::Index j = 0; j < input_dim; ++j) factor(i, j) = psi[k][next++];
    }
    covariances.emplace_back(factor * factor.transpose());
  }
  return covariances;
}

}  // namespace

Gmm read_mixture(SettingsReader& mixture, std::optional<std::array<double, 2>> range) {
  const auto input_dim =
      static_cast<int>(mixture.integer("inputs", 1, static_cast<int>(kSettingDimMax) - 1, 1,
                                       {.meaning = "How many of the numbers are inputs"}));
  const bool is_spaced = mixture.has("outputs");
  if (is_spaced && input_dim != 1) mixture.refuse("outputs", "needs `inputs` to be 1; give means");
  const Rows means =
      is_spaced ? spaced_means(mixture, range)
                : mixture.rows("means", kNumber, kSettingComponentsMax, 2, kSettingDimMax, {},
                               {.meaning = "The mean of each component: inputs, then outputs",
                                .example = "[[0.5, 1.0]]"});
  const auto dim = static_cast<Eigen::Index>(means[0].size());
  if (dim <= input_dim) {
    mixture.refuse("means",
                   fmt::format("each list must hold {} inputs and at least one output", input_dim));
  }
  const std::vector<Eigen::MatrixXd> covariances =
      mixture.has("covariances") ? read_covariances(mixture, dim, means.size())
                                 : read_factors(mixture, dim, input_dim, means.size());
  const std::vector<double> priors =
      mixture.numbers("priors", {.min = 0, .max = 1e20}, means.size(), means.size(),
                      std::vector<double>(means.size(), 1. / static_cast<double>(means.size())),
                      {.meaning = "Weights of the components",
                       .otherwise = "equal",
                       .rule = "one for each component, each 0 to 1e20"});
  std::vector<Component> components;
  for (std::size_t k = 0; k < means.size(); ++k) {
    components.push_back(
        {priors[k], Eigen::Map<const Eigen::VectorXd>(means[k].data(), dim), covariances[k]});
  }
  try {
    return Gmm(input_dim, std::move(components));
  } catch (const std::invalid_argument& error) {
    mixture.refuse(mixture.has("covariances") ? "covariances" : "deviations",
                   fmt::format("gives no mixture: {}", error.what()));
  }
}

}  // namespace treeroll
