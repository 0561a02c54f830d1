#include "learner/fit/fit_work.h"

#include <fmt/format.h>

#include "learner/fit/levenberg_marquardt.h"

namespace treeroll {
namespace {

/// Densities that are evaluated.
constexpr double kDensitiesMax = 1e9;
/// Products that a step of a refinement sums up.
constexpr double kRefinementMax = 2e8;

}  // namespace

FitWork::FitWork(const Eigen::MatrixXd& data, const FitSettings& fit)
    : samples_(static_cast<double>(data.cols())),
      inputs_(fit.input_dim),
      outputs_(static_cast<double>(data.rows()) - inputs_),
      iterations_(fit.em.num_iterations),
      is_refined_(fit.refine.has_value()) {}

double FitWork::numbers(int components) const {
  return components * (inputs_ + outputs_ + inputs_ * outputs_ + inputs_ * (inputs_ + 1) / 2 + 1);
}

double FitWork::densities(int components) const { return components * samples_ * iterations_; }

double FitWork::products(int components) const {
  return is_refined_ ? products_of_step(numbers(components), samples_ * outputs_) : 0;
}

int FitWork::last_of(const SizeRange& sizes) const {
  double densities_of_all = 0, products_of_all = 0;
  int last = sizes.first - sizes.step;
  for (int size = sizes.first; size <= sizes.most; size += sizes.step) {
    densities_of_all += densities(size);
    products_of_all += products(size);
    if (densities_of_all > kDensitiesMax || products_of_all > kRefinementMax) break;
    last = size;
  }
  return last;
}

int FitWork::most_alone() const {
  int most = 0;
  while (most < kComponentsMax && densities(most + 1) <= kDensitiesMax &&
         products(most + 1) <= kRefinementMax) {
    ++most;
  }
  return most;
}

std::optional<FitWork::TooMuch> FitWork::refusal(int components) const {
  if (densities(components) > kDensitiesMax) {
    return TooMuch{
        "fit", fmt::format("components x samples x iterations is {:.0f}, must be at most {:.0f}",
                           densities(components), kDensitiesMax)};
  }
  if (products(components) <= kRefinementMax) return std::nullopt;
  // None of the ways out is refused as well.
  const int most = most_alone();
  return TooMuch{
      "fit.refine",
      fmt::format(
          "a regression of {:.0f} numbers to {} outputs of {} samples takes too long: "
          "numbers^2 x (outputs x samples + 8/3 numbers) must be at most {:.0f}; {}",
          numbers(components), outputs_, samples_, kRefinementMax,
          most > 0 ? fmt::format("take at most {} components, or \"none\" and say how many", most)
                   : "take fewer samples, or \"none\" and say how many components")};
}

}  // namespace treeroll
