#include "learner/explore/cma_es_rule.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "common/settings/settings_reader.h"
#include "learner/explore/cma_es.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/perturbation.h"
#include "learner/explore/scale_trial.h"
#include "learner/explore/setting_bounds.h"
#include "learner/explore/systematic_search.h"

namespace treeroll::explore {
namespace {

/// A start is far from good if bold steps from it earn so many times its reward. By chance one of a
/// generation is a little better than a good start as well, from which bold steps lose much.
constexpr double kOutdone = 1.1;
/// Of the step with which sizes of the output are tried: the largest that is felt is more than a
/// search wants.
constexpr double kOfFelt = .7;
/// What a search along systematic steps is to earn for the bold one to be given up, in terms of
/// that one's best reward; and the first steps from there, in terms of the bold ones.
constexpr double kWorthGoing = 1.3;
constexpr double kAfterSystematic = .25;

class CmaEsRule final : public PopulationRule {
 public:
  CmaEsRule(const CmaEsRuleSettings& settings, const LayerStart& start)
      : PopulationRule(settings.generation, first_distribution(settings, start)),
        settings_(settings),
        search_(
            search(is_tried(settings, start) ? *settings.bold_rate_factor : settings.rate_factor,
                   distribution())) {
    if (!is_tried(settings, start)) return;
    cautious_ = start.distribution;
    bolder_ = start.bolder;
    if (!start.of_scales.empty()) {
      scales_.emplace(start.of_scales, settings.generation.population);
    }
    systematic_steps_ = start.systematic_steps;
    const double step = kAfterSystematic * start.bolder;
    small_noise_ = step * step * start.distribution.noise;
  }

  /// Where a trial of sizes earns nothing further ones follow: that has converged as anything else.
  bool is_trial() const override { return systematic_ || (scales_ && is_first_generation()); }
  Eigen::VectorXd next_normal_numbers(RandomStream stream) override {
    if (cautious_ && !std::exchange(has_drawn_mean_, true)) {
      return Eigen::VectorXd::Zero(distribution().mean.size());
    }
    if (systematic_) {
      return noise_factor(distribution().noise)
          .triangularView<Eigen::Lower>()
          .solve(systematic_->next() - distribution().mean);
    }
    Eigen::VectorXd normal;
    if (to_mirror_) {
      normal = -*std::exchange(to_mirror_, std::nullopt);
    } else {
      normal = PopulationRule::next_normal_numbers(stream);
      if (settings_.mirrored) to_mirror_ = normal;
    }
    return scales_ ? scales_->next(normal) : normal;
  }

 private:
  static bool is_tried(const CmaEsRuleSettings& settings, const LayerStart& start) {
    return settings.bold_rate_factor && start.bolder > 1;
  }
  static SearchDistribution first_distribution(const CmaEsRuleSettings& settings,
                                               const LayerStart& start) {
    SearchDistribution first = start.distribution;
    if (is_tried(settings, start)) first.noise *= start.bolder * start.bolder;
    return first;
  }
  CmaEs search(double rate_factor, const SearchDistribution& start) const {
    return CmaEs({settings_.generation.population, settings_.active, rate_factor}, start);
  }

  int generation_size() const override {
    return systematic_ ? systematic_->generation_size() : settings_.generation.population;
  }
  bool learns_from_nothing() const override { return systematic_.has_value(); }

  SearchDistribution updated(std::span<const ToldRollout> generation,
                             const SearchDistribution& before,
                             int /*num_results_of_run*/) override {
    std::vector<RatedRollout> rated;
    rated.reserve(generation.size());
    for (const ToldRollout& member : generation) rated.push_back(member.rated);
    if (systematic_) {
      systematic_->learn(rated);
      if (systematic_->is_over()) {
        end_systematic_search();
        return search_.distribution();
      }
      // Where a run may end here its policy is the best one.
      return {is_worth_going() ? systematic_->best().theta : before.mean, before.noise};
    }
    if (cautious_) {
      start_ = of_mean(rated, cautious_->mean);
      const bool is_far = best_reward() > kOutdone * start_.reward;
      if (scales_ || !is_far) {
        SearchDistribution from = *cautious_;
        if (scales_) from.noise = scales_->best(generation);
        scales_.reset();
        if (is_far) from.noise *= (kOfFelt * bolder_) * (kOfFelt * bolder_);
        begin_anew(from, is_far ? *settings_.bold_rate_factor : settings_.rate_factor);
        return search_.distribution();
      }
    }
    const bool was_trial = std::exchange(cautious_, std::nullopt).has_value();
    search_.update(rated);
    if (!was_trial && !systematic_steps_.empty()) begin_systematic_search();
    return search_.distribution();
  }

  /// Gives up what the search has learnt.
  void begin_anew(const SearchDistribution& from, double rate_factor) {
    cautious_.reset();
    systematic_steps_.clear();
    to_mirror_.reset();  // the mirror of a draw of another noise
    search_ = search(rate_factor, from);
  }

  /// After the bold trial and a bold generation, which are about as many roll-outs.
  void begin_systematic_search() {
    systematic_.emplace(start_, std::exchange(systematic_steps_, {}));
    best_boldly_ = best_reward();
  }

  /// Goes on near what has been found with small steps, or boldly as before.
  void end_systematic_search() {
    if (is_worth_going()) {
      begin_anew({systematic_->best().theta, small_noise_}, settings_.rate_factor);
    }
    systematic_.reset();
  }
  bool is_worth_going() const { return systematic_->best().reward > kWorthGoing * best_boldly_; }

  /// Without the mean among them it earned nothing, in a generation that taught nothing.
  static RatedRollout of_mean(std::span<const RatedRollout> generation,
                              const Eigen::VectorXd& mean) {
    for (const RatedRollout& member : generation) {
      if (member.theta == mean) return member;
    }
    return {.theta = mean};
  }

  CmaEsRuleSettings settings_;
  std::optional<Eigen::VectorXd> to_mirror_;  // of the last draw, if it has no mirror
  CmaEs search_;
  std::optional<SearchDistribution> cautious_;  // while the first step is tried: what to go back to
  double bolder_ = 1;                           // than that
  std::optional<ScaleTrial> scales_;            // while sizes of the output are tried as well
  bool has_drawn_mean_ = false;
  std::vector<Eigen::VectorXd> systematic_steps_;  // until a search along them begins
  RatedRollout start_;                             // where it begins
  std::optional<SystematicSearch> systematic_;     // while it goes on
  double best_boldly_ = 0;                         // what it is to outdo
  Eigen::MatrixXd small_noise_;                    // to go on with where it ends
};

}  // namespace

std::unique_ptr<UpdateRule> make_rule(const CmaEsRuleSettings& settings, const LayerStart& start) {
  return std::make_unique<CmaEsRule>(settings, start);
}

void read_automatic(SettingsReader& /*exploration*/, ExplorationSettings& settings) {
  // Measured on the swing-up: README.md.
  settings.rule = CmaEsRuleSettings{.rate_factor = 5, .bold_rate_factor = 2};
  settings.tries_scale = true;
}

void read_cma_es(SettingsReader& exploration, ExplorationSettings& settings) {
  CmaEsRuleSettings cma_es;
  cma_es.generation = read_generation(exploration, cma_es.generation.population);
  cma_es.active = exploration.boolean(
      "active", cma_es.active,
      {.meaning = "Whether bad members of a generation take variance away along their steps"});
  cma_es.mirrored =
      exploration.boolean("mirrored", cma_es.mirrored,
                          {.meaning = "Whether draws come in pairs of opposite perturbations"});
  cma_es.rate_factor = exploration.number(
      "rate_factor", {.min = .01, .max = 100}, cma_es.rate_factor,
      {.meaning = "On the covariance's learning rates c_1 (at most .5) and c_mu (at "
                  "most 1 - c_1); 5 serves the swing-up"});
  settings.rule = cma_es;
  if (exploration.choice("coordinates", {"noise_variance", "sensitivity"}, "noise_variance",
                         {.meaning = "What the first noise comes from: the study, or the effect of "
                                     "each element of theta on the output; noise_variance is "
                                     "refused then"}) == "sensitivity") {
    settings.initial_step =
        exploration.number("initial_step", kFactor, .03,
                           {.meaning = "Deviation of the first steps in sensitivity coordinates",
                            .unit = "the output's unit"});
  }
}

}  // namespace treeroll::explore
