#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/outcome.h"
#include "common/policy/policy.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/layer_search.h"

namespace treeroll::explore {

/// A roll-out to be made.
struct Draw {
  int rollout = 0;        ///< 0 .. N-1
  int layer = 0;          ///< drawn at
  Eigen::VectorXd theta;  ///< perturbed parameters, for policy(layer)
};

/// One run: algorithm 2 of the thesis as ask and tell. A pure function of its settings, start,
/// seed, repetition and the results told, in the order they are told. Not when ask() is called:
/// roll-out i is drawn as soon as max(0, i - in_flight + 1) results have been told, and ask()
/// hands it out as it was drawn.
///
///   Exploration run(settings, start, seed, repetition);
///   while (!run.done()) {
///     while (std::optional<Draw> draw = run.ask()) execute(run.policy(draw->layer), *draw);
///     const auto [rollout, outcome] = wait_for_a_result();
///     run.tell(rollout, outcome);
///   }
class Exploration {
 public:
  /// Precondition: the settings obey the rules of read_exploration_settings() for this start,
  /// num_rollouts and in_flight are at least 1.
  Exploration(const ExplorationSettings& settings, const Policy& start, std::uint64_t seed,
              std::uint32_t repetition);
  /// @param first  first_start() of these settings and this start: many runs share it
  Exploration(ExplorationSettings settings, const Policy& start, LayerStart first,
              std::uint64_t seed, std::uint32_t repetition);

  /// The next roll-out in number order, or none until more results have been told.
  std::optional<Draw> ask();
  /// The roll-out of this number, if it was asked for and has not been told, else null.
  const Draw* find(int rollout) const;
  /// What theta of that roll-out was drawn from; null as find() is.
  const SearchDistribution* drawn_from(int rollout) const;
  /// Applies the result of a roll-out that was asked for and not told before.
  /// Precondition: the reward is finite and not negative.
  void tell(int rollout, const Outcome& outcome);
  /// The same in two steps, since the start of a layer may take seconds: where the result ends a
  /// layer, make_switch() comes before anything else is told, and before stop().
  void tell_but_switch(int rollout, const Outcome& outcome);
  bool is_at_switch() const { return leaves_after_.has_value(); }
  /// Precondition: is_at_switch().
  void make_switch();

  /// An early stop, now, whatever the rewards: the study's time is up. For a run to be a function
  /// of what it was told, this is to be repeated at the same place between two tells.
  void stop() { stopped_ = true; }

  /// All that was drawn has been told, and no more is drawn: the N of the budget, or fewer after a
  /// stop at a target reward, on convergence or by stop().
  bool done() const;
  /// The study's rule for an early stop has been met, or stop() was called: results that are still
  /// out are told and may be the best, but nothing is learnt from them or drawn.
  bool stopped_early() const { return stopped_; }
  int num_told() const { return num_told_; }
  int layer() const { return policies_.back()->layer(); }  ///< being explored
  /// The policy as it was when `layer` began to be explored: what theta~ refers to.
  /// Precondition: the layer has begun. The reference stays valid as long as the run.
  const Policy& policy(int layer) const;
  /// Current mean parameters of layer(). After an early stop as they were at the stop.
  const Eigen::VectorXd& mean() const { return search_.distribution().mean; }
  /// Current exploration noise of layer(), a covariance.
  const Eigen::MatrixXd& noise() const { return search_.distribution().noise; }

  struct Best {
    int rollout = -1;  ///< -1 before the first result
    int layer = 0;     ///< drawn at: theta is for policy(layer)
    double reward = 0;
    Eigen::VectorXd theta;
  };
  /// The highest reward told, of any layer; of equal ones the lowest number.
  const Best& best() const { return best_; }
  /// Roll-outs after whose result the run went on to the next layer.
  const std::vector<int>& switches() const { return switches_; }
  /// By switch, the slope of the rewards in the window at which the layer was left.
  const std::vector<double>& slopes_at_switches() const { return slopes_at_switches_; }
  /// Slope and mean of the rewards in the convergence window of this layer; nothing before two.
  std::optional<double> reward_slope() const { return search_.reward_slope(); }
  std::optional<double> mean_reward() const { return search_.mean_reward(); }

 private:
  void draw_what_is_permitted();
  void keep_if_best(const Draw& draw, double reward);
  /// False, and the run stays in its layer until a later result, where the noise has driven theta
  /// so far that rounding leaves no valid policy to go on from.
  bool go_to_next_layer();
  bool stops_after(double reward) const;

  struct Pending {
    Draw draw;
    std::shared_ptr<const SearchDistribution> from;
  };

  ExplorationSettings settings_;
  std::uint64_t seed_;
  std::uint32_t repetition_;
  std::vector<PolicyPtr> policies_;  // of the layers begun, the first being first_layer
  LayerSearch search_;               // of layer()
  std::map<int, Pending> drawn_;     // not told yet, by number: at most in_flight
  int next_draw_ = 0;
  int next_ask_ = 0;
  int num_told_ = 0;
  std::optional<int> leaves_after_;  // the roll-out whose result has ended the layer
  bool stopped_ = false;
  Best best_;
  std::vector<int> switches_;
  std::vector<double> slopes_at_switches_;
};

}  // namespace treeroll::explore
