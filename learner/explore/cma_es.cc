#include "learner/explore/cma_es.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/numbers/elementary.h"
#include "common/numbers/mirrored.h"
#include "learner/explore/perturbation.h"

namespace treeroll::explore {
namespace {

/// The step size stays within these shares of the start's, whatever the rewards say: a plateau
/// leaves it to chance, and its numbers must not run out.
constexpr double kSigmaMin = 1e-10;
constexpr double kSigmaMax = 1e10;
/// No axis is shorter than this share of the longest, in variance.
constexpr double kConditionMin = 1e-14;
/// However fast the rates, the path replaces at most half of the covariance: mirrored members of
/// equal reward have a path of exactly zero, and all of it would be nothing.
constexpr double kPathRateMax = .5;

double squared(double x) { return x * x; }

/// (sum w)^2 / sum w^2 over the weights of one sign.
double effective_number(const std::vector<double>& raw, bool positive) {
  double sum = 0;
  double squares = 0;
  for (const double weight : raw) {
    if ((weight > 0) != positive) continue;
    sum += weight;
    squares += weight * weight;
  }
  return squares > 0 ? sum * sum / squares : 0;
}

}  // namespace

CmaEs::CmaEs(CmaEsSettings settings, const SearchDistribution& start)
    : n_(start.mean.size()), origin_(start.mean), factor_(noise_factor(start.noise)) {
  CHECK(settings.population >= 2 && settings.rate_factor > 0, "CMA-ES needs two members");
  const auto n = static_cast<double>(n_);
  const double lambda = settings.population;

  std::vector<double> raw;  // (49)
  for (int i = 1; i <= settings.population; ++i) {
    raw.push_back(elementary::log((lambda + 1) / 2) - elementary::log(i));
    // The middle rank of an odd population: 0 but for rounding.
    if (2 * i == settings.population + 1) raw.back() = 0;
  }
  mu_eff_ = effective_number(raw, true);
  const double mu_eff_negative = effective_number(raw, false);

  c_sigma_ = (mu_eff_ + 2) / (n + mu_eff_ + 5);  // (55)
  d_sigma_ = 1 + 2 * std::max(0., std::sqrt((mu_eff_ - 1) / (n + 1)) - 1) + c_sigma_;
  c_c_ = (4 + mu_eff_ / n) / (n + 4 + 2 * mu_eff_ / n);  // (56)
  c_1_ = std::min(kPathRateMax,
                  settings.rate_factor * 2 / (squared(n + 1.3) + mu_eff_));  // (57)
  c_mu_ = std::min(1 - c_1_, settings.rate_factor * 2 * (.25 + mu_eff_ + 1 / mu_eff_ - 2) /
                                 (squared(n + 2) + mu_eff_));  // (58)
  chi_n_ = std::sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n));

  double negative_sum = 0;  // (50)..(53)
  if (settings.active && c_mu_ > 0) {
    negative_sum = std::min({1 + c_1_ / c_mu_, 1 + 2 * mu_eff_negative / (mu_eff_ + 2),
                             (1 - c_1_ - c_mu_) / (n * c_mu_)});
  }
  double raw_positive = 0;
  double raw_negative = 0;
  for (const double weight : raw) (weight > 0 ? raw_positive : raw_negative) += weight;
  for (const double weight : raw) {
    weights_.push_back(weight > 0 ? weight / raw_positive : -negative_sum * weight / raw_negative);
  }

  mean_ = Eigen::VectorXd::Zero(n_);
  covariance_ = whitening_ = Eigen::MatrixXd::Identity(n_, n_);
  path_sigma_ = path_c_ = Eigen::VectorXd::Zero(n_);
}

void CmaEs::share_among_equals(std::span<const RatedRollout> ranked, std::vector<double>& weights) {
  for (std::size_t first = 0; first < ranked.size();) {
    std::size_t last = first;
    double sum = 0;
    while (last < ranked.size() && ranked[last].reward == ranked[first].reward) {
      sum += weights[last++];
    }
    if (last - first > 1) {
      for (std::size_t i = first; i < last; ++i) {
        weights[i] = sum / static_cast<double>(last - first);
      }
    }
    first = last;
  }
}

void CmaEs::update(std::span<const RatedRollout> generation) {
  CHECK(generation.size() == weights_.size(), "a generation has lambda members");
  std::vector<RatedRollout> ranked(generation.begin(), generation.end());
  std::sort(ranked.begin(), ranked.end(), ranks_before);
  std::vector<double> weights = weights_;
  share_among_equals(ranked, weights);
  // Of the mean: the negative ones are the covariance's alone.
  std::vector<double> mean_weights;
  for (const double weight : weights_) mean_weights.push_back(std::max(weight, 0.));
  share_among_equals(ranked, mean_weights);
  const auto n = static_cast<double>(n_);

  // Steps y in units of sigma, clipped; (40)..(41) the other way round.
  const double longest = std::sqrt(n) + 2 * n / (n + 2);
  Eigen::MatrixXd steps(n_, static_cast<Eigen::Index>(ranked.size()));
  std::vector<double> lengths;
  Eigen::VectorXd mean_step = Eigen::VectorXd::Zero(n_);
  for (std::size_t i = 0; i < ranked.size(); ++i) {
    const Eigen::VectorXd z =
        factor_.triangularView<Eigen::Lower>().solve(ranked[i].theta - origin_);
    Eigen::VectorXd step = (z - mean_) / sigma_;
    const double length = (whitening_ * step).norm();
    if (length > longest) step *= longest / length;
    lengths.push_back(std::min(length, longest));
    mean_step += mean_weights[i] * step;
    steps.col(static_cast<Eigen::Index>(i)) = step;
  }
  mean_ += sigma_ * mean_step;  // (42)

  path_sigma_ = (1 - c_sigma_) * path_sigma_ +  // (43)
                std::sqrt(c_sigma_ * (2 - c_sigma_) * mu_eff_) * (whitening_ * mean_step);
  path_sigma_start_share_ *= squared(1 - c_sigma_);
  const double path_length = path_sigma_.norm();
  const bool stalls =
      path_length / std::sqrt(1 - path_sigma_start_share_) >= (1.4 + 2 / (n + 1)) * chi_n_;
  path_c_ = (1 - c_c_) * path_c_;  // (45)
  if (!stalls) path_c_ += std::sqrt(c_c_ * (2 - c_c_) * mu_eff_) * mean_step;

  double weight_sum = 0;
  for (const double weight : weights) weight_sum += weight;
  const double made_up = stalls ? c_1_ * c_c_ * (2 - c_c_) : 0;
  Eigen::MatrixXd next = (1 + made_up - c_1_ - c_mu_ * weight_sum) * covariance_;  // (47)
  next.selfadjointView<Eigen::Lower>().rankUpdate(path_c_, c_1_);
  for (std::size_t i = 0; i < ranked.size(); ++i) {
    // (46): a negative weight counts as if its step had the length of an average one.
    double weight = weights[i];
    if (weight < 0) weight *= n / std::max(squared(lengths[i]), 1e-12);
    next.selfadjointView<Eigen::Lower>().rankUpdate(steps.col(static_cast<Eigen::Index>(i)),
                                                    c_mu_ * weight);
  }
  covariance_ = mirrored(next);
  sigma_ *=
      elementary::exp(std::min(1., c_sigma_ / d_sigma_ * (path_length / chi_n_ - 1)));  // (44)
  decompose();
}

void CmaEs::decompose() {
  // Mean variance 1: sigma alone says how large the noise is. Nothing else changes.
  const double scale = covariance_.trace() / static_cast<double>(n_);
  CHECK(std::isfinite(scale) && scale > 0, "a covariance of variances above 0");
  covariance_ /= scale;
  path_c_ /= std::sqrt(scale);
  sigma_ = std::clamp(sigma_ * std::sqrt(scale), kSigmaMin, kSigmaMax);

  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(covariance_);
  CHECK(axes.info() == Eigen::Success, "a finite symmetric matrix has eigenvalues");
  const Eigen::MatrixXd& vectors = axes.eigenvectors();
  const double least = kConditionMin * axes.eigenvalues().maxCoeff();
  const Eigen::VectorXd values = axes.eigenvalues().cwiseMax(least);
  if (axes.eigenvalues().minCoeff() < least) {
    covariance_ = mirrored(vectors * values.asDiagonal() * vectors.transpose());
  }
  whitening_ = vectors * values.cwiseSqrt().cwiseInverse().asDiagonal() * vectors.transpose();
}

SearchDistribution CmaEs::distribution() const {
  return {origin_ + factor_ * mean_,
          mirrored(sigma_ * sigma_ * (factor_ * covariance_ * factor_.transpose()))};
}

}  // namespace treeroll::explore
