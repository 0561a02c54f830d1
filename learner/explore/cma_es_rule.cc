#include "learner/explore/cma_es_rule.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "common/settings/settings_reader.h"
#include "learner/explore/cma_es.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/scale_trial.h"
#include "learner/explore/setting_bounds.h"

namespace treeroll::explore {
namespace {

/// A start is far from good if bold steps from it earn so many times its reward. By chance one of a
/// generation is a little better than a good start as well, from which bold steps lose much.
constexpr double kOutdone = 1.1;
/// Of the step with which sizes of the output are tried: the largest that is felt is more than a
/// search wants.
constexpr double kOfFelt = .7;

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
  }

  /// Where nothing earns anything further ones follow: that has converged as anything else has.
  bool is_trial() const override { return scales_ && is_first_generation(); }
  Eigen::VectorXd next_normal_numbers(RandomStream stream) override {
    if (cautious_ && !std::exchange(has_drawn_mean_, true)) {
      return Eigen::VectorXd::Zero(distribution().mean.size());
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

  SearchDistribution updated(std::span<const ToldRollout> generation,
                             const SearchDistribution& /*before*/,
                             int /*num_results_of_run*/) override {
    if (cautious_) {
      SearchDistribution from = *std::exchange(cautious_, std::nullopt);
      const bool is_far = is_outdone(generation, from.mean);
      if (scales_ || !is_far) {
        if (scales_) from.noise = scales_->best(generation);
        scales_.reset();
        if (is_far) from.noise *= (kOfFelt * bolder_) * (kOfFelt * bolder_);
        to_mirror_.reset();  // the mirror of a draw of the trial is none of the noise that follows
        search_ = search(is_far ? *settings_.bold_rate_factor : settings_.rate_factor, from);
        return search_.distribution();
      }
    }
    std::vector<RatedRollout> rated;
    rated.reserve(generation.size());
    for (const ToldRollout& member : generation) rated.push_back(member.rated);
    search_.update(rated);
    return search_.distribution();
  }

  /// Whether a member is far better than the mean; so without the mean among them, too: it earned
  /// nothing in a generation that taught nothing.
  static bool is_outdone(std::span<const ToldRollout> generation, const Eigen::VectorXd& mean) {
    double best = 0;
    double of_mean = 0;
    for (const ToldRollout& member : generation) {
      if (member.rated.theta == mean) of_mean = member.rated.reward;
      best = std::max(best, member.rated.reward);
    }
    return best > kOutdone * of_mean;
  }

  CmaEsRuleSettings settings_;
  std::optional<Eigen::VectorXd> to_mirror_;  // of the last draw, if it has no mirror
  CmaEs search_;
  std::optional<SearchDistribution> cautious_;  // while the first step is tried: what to go back to
  double bolder_ = 1;                           // than that
  std::optional<ScaleTrial> scales_;            // while sizes of the output are tried as well
  bool has_drawn_mean_ = false;
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
