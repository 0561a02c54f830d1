#include "learner/fit/kmeans.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/numbers/mirrored.h"
#include "common/numbers/random_stream.h"

namespace treeroll {
namespace {

constexpr int kIterationsMax = 1000;

/// Rows divided by their standard deviation. One that does not vary tells no two observations
/// apart: it may only be an output, with a variance that the fit adds.
Eigen::MatrixXd standardised(const Eigen::MatrixXd& data, int input_dim,
                             const Eigen::VectorXd& regularisation) {
  Eigen::MatrixXd scaled = data;
  for (Eigen::Index i = 0; i < data.rows(); ++i) {
    double mean = 0, variance = 0;
    for (Eigen::Index n = 0; n < data.cols(); ++n) mean += data(i, n);
    mean /= static_cast<double>(data.cols());
    for (Eigen::Index n = 0; n < data.cols(); ++n) {
      variance += (data(i, n) - mean) * (data(i, n) - mean);
    }
    variance /= static_cast<double>(data.cols());
    const bool varies = data.row(i).minCoeff() < data.row(i).maxCoeff() && variance > 0;
    if (!varies && !(i >= input_dim && regularisation[i] > 0)) {
      throw FitError(fmt::format("row {} of the data does not vary", i));
    }
    scaled.row(i).setZero();
    if (varies) scaled.row(i) = (data.row(i).array() - mean) / std::sqrt(variance);
  }
  return scaled;
}

double squared_distance(const Eigen::MatrixXd& a, Eigen::Index i, const Eigen::MatrixXd& b,
                        Eigen::Index j) {
  double sum = 0;
  for (Eigen::Index row = 0; row < a.rows(); ++row) {
    sum += (a(row, i) - b(row, j)) * (a(row, i) - b(row, j));
  }
  return sum;
}

/// k-means++: each next centre is an observation drawn by its squared distance to those before.
Eigen::MatrixXd first_centres(const Eigen::MatrixXd& data, int num_components, std::uint64_t seed) {
  RandomStream random(seed, 0, 0, RandomPurpose::kFit);
  Eigen::MatrixXd centres(data.rows(), num_components);
  std::vector<double> distance(static_cast<std::size_t>(data.cols()), 1.);
  for (int k = 0; k < num_components; ++k) {
    double sum = 0;
    for (const double d : distance) sum += d;
    if (!(sum > 0)) {
      throw FitError(fmt::format("there are fewer different observations than the {} components",
                                 num_components));
    }
    double rest = random.next_uniform() * sum;
    std::size_t drawn = 0;
    for (std::size_t n = 0; n < distance.size(); ++n) {
      if (!(distance[n] > 0)) continue;
      drawn = n;
      rest -= distance[n];
      if (rest <= 0) break;
    }
    centres.col(k) = data.col(static_cast<Eigen::Index>(drawn));
    for (std::size_t n = 0; n < distance.size(); ++n) {
      const double here = squared_distance(data, static_cast<Eigen::Index>(n), centres, k);
      distance[n] = k == 0 ? here : std::min(distance[n], here);
    }
  }
  return centres;
}

/// Nearest centre of each observation, the first of equally near ones. A centre without any gets
/// the observation farthest from its own among those that are not alone.
std::vector<int> assigned(const Eigen::MatrixXd& data, const Eigen::MatrixXd& centres) {
  const auto num_observations = static_cast<std::size_t>(data.cols());
  std::vector<int> cluster(num_observations);
  std::vector<double> distance(num_observations);
  std::vector<int> count(static_cast<std::size_t>(centres.cols()), 0);
  for (std::size_t n = 0; n < num_observations; ++n) {
    distance[n] = std::numeric_limits<double>::infinity();
    for (int k = 0; k < centres.cols(); ++k) {
      const double here = squared_distance(data, static_cast<Eigen::Index>(n), centres, k);
      if (here < distance[n]) {
        distance[n] = here;
        cluster[n] = k;
      }
    }
    ++count[static_cast<std::size_t>(cluster[n])];
  }
  for (std::size_t k = 0; k < count.size(); ++k) {
    if (count[k] > 0) continue;
    std::size_t farthest = num_observations;
    for (std::size_t n = 0; n < num_observations; ++n) {
      if (count[static_cast<std::size_t>(cluster[n])] < 2) continue;
      if (farthest == num_observations || distance[n] > distance[farthest]) farthest = n;
    }
    CHECK(farthest < num_observations, "as many observations as components");
    --count[static_cast<std::size_t>(cluster[farthest])];
    cluster[farthest] = static_cast<int>(k);
    distance[farthest] = 0;
    count[k] = 1;
  }
  return cluster;
}

/// Prior, mean and covariance of one cluster; N is counted from the assignment.
Component moments(const Eigen::MatrixXd& data, const std::vector<int>& cluster, int k) {
  Component c{0, Eigen::VectorXd::Zero(data.rows()),
              Eigen::MatrixXd::Zero(data.rows(), data.rows())};
  double count = 0;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    if (cluster[static_cast<std::size_t>(n)] != k) continue;
    c.mean += data.col(n);
    ++count;
  }
  c.mean /= count;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    if (cluster[static_cast<std::size_t>(n)] != k) continue;
    const Eigen::VectorXd apart = data.col(n) - c.mean;
    c.covariance += apart * apart.transpose();
  }
  c.covariance = mirrored(c.covariance / count);
  c.prior = count / static_cast<double>(data.cols());
  return c;
}

}  // namespace

Gmm kmeans(const Eigen::MatrixXd& data, int input_dim, int num_components, std::uint64_t seed,
           const Eigen::VectorXd& regularisation) {
  CHECK(num_components >= 1 && regularisation.size() == data.rows(), "shapes of k-means");
  const Eigen::MatrixXd scaled = standardised(data, input_dim, regularisation);
  Eigen::MatrixXd centres = first_centres(scaled, num_components, seed);
  std::vector<int> cluster = assigned(scaled, centres);
  for (int iteration = 0; iteration < kIterationsMax; ++iteration) {
    for (int k = 0; k < num_components; ++k) centres.col(k) = moments(scaled, cluster, k).mean;
    std::vector<int> next = assigned(scaled, centres);
    if (next == cluster) break;
    cluster = std::move(next);
  }
  std::vector<Component> components;
  for (int k = 0; k < num_components; ++k) {
    components.push_back(moments(data, cluster, k));
    components.back().covariance.diagonal() += regularisation;
  }
  std::stable_sort(components.begin(), components.end(),
                   [](const Component& a, const Component& b) { return a.mean[0] < b.mean[0]; });
  return Gmm(input_dim, std::move(components));
}

}  // namespace treeroll
