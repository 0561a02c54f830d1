#include "learner/fit/network_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/numbers/elementary.h"
#include "common/numbers/mirrored.h"
#include "common/numbers/random_stream.h"
#include "common/policy/input_range.h"
#include "common/policy/network/network_policy.h"
#include "common/settings/settings_reader.h"
#include "learner/fit/demonstration_settings.h"
#include "learner/fit/levenberg_marquardt.h"
#include "learner/fit/relative_error.h"

namespace treeroll {
namespace {

constexpr int kStartsMax = 20;
/// Products that a step of all starts together sums up: half a minute of a processor.
constexpr double kProductsMax = 2e8;
/// Almost to the end, as far as the figures of learner/explore were measured from.
constexpr RegressionSettings kToTheEnd{.stop_relative_error = .002};

/// A network whose outputs meet the data.
class NetworkProblem {
 public:
  NetworkProblem(const Eigen::MatrixXd& data, Eigen::Index num_inputs)
      : inputs_(data.topRows(num_inputs)),
        outputs_(data.bottomRows(data.rows() - num_inputs)),
        unit_(output_units(outputs_)),
        share_(1 / (1 - outputs_.array().isNaN().cast<double>()).sum()) {}

  const Eigen::VectorXd& unit() const { return unit_; }

  double cost(const Network& network) const {
    double sum = 0;
    for_each_error(network, [&](double error, Eigen::Index, const auto&) { sum += error * error; });
    return sum * share_;
  }
  Network stepped(const Network& network, const Eigen::VectorXd& step) const {
    return network.with(network.numbers() + step);
  }
  /// Sums are written out, sample by sample: the same bits on every machine.
  Normal normal(const Network& network) const {
    const Eigen::Index size = network.outer.size() + network.inner.size();
    Normal result{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
    Eigen::MatrixXd derivative;
    Eigen::VectorXd row;
    for_each_error(network, [&](double error, Eigen::Index o, const Inside& inside) {
      network.derivative(inside.scaled, inside.hidden, derivative);
      row = derivative.row(o).transpose() / unit_[o];
      result.gradient += error * row;
      add_square(row, result.squares);
    });
    result.gradient *= share_;
    result.squares = mirrored(share_ * result.squares);
    return result;
  }

 private:
  struct Inside {
    std::vector<double> scaled;
    std::vector<double> hidden;
  };

  /// Calls visit(relative error, output, inside) for every output that is there.
  template <typename Visit>
  void for_each_error(const Network& network, const Visit& visit) const {
    Inside inside{std::vector<double>(network.ranges.size()),
                  std::vector<double>(static_cast<std::size_t>(network.num_hidden()))};
    std::vector<double> output(static_cast<std::size_t>(network.num_outputs()));
    for (Eigen::Index n = 0; n < inputs_.cols(); ++n) {
      network.act({inputs_.col(n).data(), inside.scaled.size()}, inside.scaled, inside.hidden,
                  output);
      for (Eigen::Index o = 0; o < outputs_.rows(); ++o) {
        if (std::isnan(outputs_(o, n))) continue;
        visit((output[static_cast<std::size_t>(o)] - outputs_(o, n)) / unit_[o], o, inside);
      }
    }
  }

  Eigen::MatrixXd inputs_;
  Eigen::MatrixXd outputs_;
  Eigen::VectorXd unit_;
  double share_;
};

/// Hidden units whose turns are spread over the ranges; a is drawn, of this size for each output.
Network drawn(std::vector<Network::Range> ranges, int num_hidden, const Eigen::VectorXd& size,
              RandomStream& draws) {
  const auto num_inputs = static_cast<Eigen::Index>(ranges.size());
  Network network{.ranges = std::move(ranges),
                  .outer = Eigen::MatrixXd::Zero(size.size(), num_hidden + 1),
                  .inner = Eigen::MatrixXd(num_hidden, num_inputs + 1)};
  const double steepness =
      .75 * elementary::exp(elementary::log(num_hidden) / static_cast<double>(num_inputs));
  for (Eigen::Index j = 0; j < num_hidden; ++j) {
    Eigen::RowVectorXd direction = Eigen::RowVectorXd::Ones(num_inputs);
    for (Eigen::Index i = 0; i < num_inputs && num_inputs > 1; ++i) {
      direction[i] = draws.next_normal();
    }
    const double length = steepness * (1 + .3 * draws.next_normal());
    const double place = num_hidden == 1 ? 0 : -1 + 2 * static_cast<double>(j) / (num_hidden - 1);
    network.inner.row(j).head(num_inputs) = length * direction / direction.norm();
    network.inner(j, num_inputs) = -length * place;
    for (Eigen::Index o = 0; o < size.size(); ++o) {
      network.outer(o, j) = size[o] * draws.next_normal();
    }
  }
  return network;
}

RandomStream draws_of(int seed) {
  return {static_cast<std::uint64_t>(seed), 0, 0, RandomPurpose::kFit};
}

int count_starts(SettingsReader& policy, const Demonstration& demonstration, int num_hidden) {
  const double inputs = demonstration.input_dim;
  const double outputs = static_cast<double>(demonstration.data.rows()) - inputs;
  const double samples = static_cast<double>(demonstration.data.cols());
  const auto numbers = [&](int hidden) { return hidden * (inputs + 1) + outputs * (hidden + 1); };
  const auto products = [&](int hidden) {
    return products_of_step(numbers(hidden), samples * outputs);
  };
  if (products(num_hidden) > kProductsMax) {
    int most = num_hidden - 1;
    while (most > 0 && products(most) > kProductsMax) --most;
    policy.refuse(
        "hidden",
        fmt::format("a fit of {:.0f} numbers to {} outputs of {} samples takes too long: "
                    "numbers^2 x (outputs x samples + 8/3 numbers) must be at most {:.0f}; take {}",
                    numbers(num_hidden), outputs, samples, kProductsMax,
                    most > 0 ? fmt::format("at most {} hidden units", most) : "fewer samples"));
  }
  return std::clamp(static_cast<int>(kProductsMax / products(num_hidden)), 1, kStartsMax);
}

Network fit_network(const Demonstration& demonstration, int num_hidden, int num_starts,
                    RandomStream draws) {
  const Eigen::MatrixXd& data = demonstration.data;
  const NetworkProblem problem(data, demonstration.input_dim);
  std::vector<Network::Range> ranges;
  for (int i = 0; i < demonstration.input_dim; ++i) {
    ranges.push_back({data.row(i).minCoeff(), data.row(i).maxCoeff()});
  }
  std::optional<Minimised<Network>> best;
  for (int start = 0; start < num_starts; ++start) {
    Minimised<Network> found =
        minimised(problem, drawn(ranges, num_hidden, problem.unit(), draws), kToTheEnd);
    if (!best || found.cost < best->cost) best = std::move(found);
  }
  return std::move(best->point);
}

StartPolicy constant_network(SettingsReader& policy, int num_hidden, RandomStream draws) {
  std::vector<Network::Range> ranges;
  for (const std::vector<double>& ends :
       policy.rows("ranges", kAnyNumber, NetworkPolicy::kSignalsMax, 2, 2, {},
                   {.meaning = "Where each input is expected, a row each",
                   .example = "[[-1.0, 1.0], [-3.0, 3.0]]"})) {
    if (!is_input_range(ends[0], ends[1])) {
      policy.refuse("ranges", std::string("each ") + kInputRangeRule);
    }
    ranges.push_back({ends[0], ends[1]});
  }
  const std::vector<double> values =
      policy.numbers("values", {.min = -1e50, .max = 1e50}, 1, NetworkPolicy::kSignalsMax,
                     std::vector<double>{0}, {.meaning = "What each output begins with"});
  const auto num_outputs = static_cast<Eigen::Index>(values.size());
  Network network = drawn(std::move(ranges), num_hidden, Eigen::VectorXd::Zero(num_outputs), draws);
  for (Eigen::Index o = 0; o < num_outputs; ++o) {
    network.outer(o, num_hidden) = values[static_cast<std::size_t>(o)];
  }
  return {.policy = std::make_shared<NetworkPolicy>(std::move(network))};
}

bool is_alike(const Policy& known, const Demonstration& demonstration, int num_hidden) {
  const auto* network = dynamic_cast<const NetworkPolicy*>(&known);
  return network != nullptr && network->input_dim() == demonstration.input_dim &&
         network->output_dim() + network->input_dim() == demonstration.data.rows() &&
         network->network().num_hidden() == num_hidden;
}

}  // namespace

StartPolicy read_network_start(SettingsReader& policy, const StartSources& sources) {
  const bool is_constant =
      policy.choice("start", {"fit", "constant"}, "fit",
                    {.meaning = "A fit to a demonstration, or one number for each output and no "
                                "demonstration"}) == "constant";
  const int num_hidden = static_cast<int>(
      policy.integer("hidden", 1, NetworkPolicy::kHiddenMax, 5, {.meaning = "Hidden units"}));
  const RandomStream draws = draws_of(static_cast<int>(policy.integer(
      "seed", 0, 1'000'000'000, 1, {.meaning = "Of the numbers that a fit begins with"})));
  if (is_constant) return constant_network(policy, num_hidden, draws);
  const Demonstration demonstration = read_demonstration(policy.table("demonstration"), sources);
  StartPolicy start{.policy = {},
                    .log_likelihoods = {},
                    .demonstration = std::make_shared<const Eigen::MatrixXd>(demonstration.data),
                    .demonstration_text = demonstration.text};
  if (sources.fitted) {
    if (!is_alike(*sources.fitted->policy, demonstration, num_hidden)) {
      policy.refuse("demonstration",
                    "the study's stored start is another one: its kind or a size differs");
    }
    start.policy = sources.fitted->policy;
    return start;
  }
  for (int i = 0; i < demonstration.input_dim; ++i) {
    const auto inputs = demonstration.data.row(i);
    if (is_input_range(inputs.minCoeff(), inputs.maxCoeff())) continue;
    policy.refuse("demonstration", fmt::format("the range of input {} {}", i + 1, kInputRangeRule));
  }
  const int num_starts = count_starts(policy, demonstration, num_hidden);
  try {
    start.policy =
        std::make_shared<NetworkPolicy>(fit_network(demonstration, num_hidden, num_starts, draws));
  } catch (const std::invalid_argument& error) {
    policy.refuse("demonstration", fmt::format("no network can be fitted: {}", error.what()));
  }
  return start;
}

}  // namespace treeroll
