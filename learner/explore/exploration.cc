#include "learner/explore/exploration.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/base/check.h"
#include "learner/explore/layer_start.h"

namespace treeroll::explore {
namespace {

ExplorationSettings checked(ExplorationSettings settings, const Policy& start) {
  CHECK(settings.num_rollouts >= 1, "a run needs a roll-out");
  CHECK(settings.in_flight >= 1, "nothing could ever be drawn");
  CHECK(1 <= settings.first_layer && settings.first_layer <= settings.last_layer &&
            settings.last_layer <= start.num_layers(),
        "layers to explore outside the policy");
  CHECK(!settings.metric || (settings.initial_step && settings.output_scale > 0),
        "a metric goes with a step and a scale");
  CHECK(settings.initial_step ||
            settings.noise_variance.size() == static_cast<std::size_t>(start.noise_variance_dim()),
        "noise_variance does not fit theta");
  return settings;
}

}  // namespace

Exploration::Exploration(const ExplorationSettings& settings, const Policy& start,
                         std::uint64_t seed, std::uint32_t repetition)
    : Exploration(settings, start, first_start(checked(settings, start), start), seed, repetition) {
}

Exploration::Exploration(ExplorationSettings settings, const Policy& start, LayerStart first,
                         std::uint64_t seed, std::uint32_t repetition)
    : settings_(checked(std::move(settings), start)),
      seed_(seed),
      repetition_(repetition),
      policies_{start.at_layer(settings_.first_layer)},
      search_(settings_, std::move(first)) {
  draw_what_is_permitted();
}

std::optional<Draw> Exploration::ask() {
  if (next_ask_ == next_draw_) return std::nullopt;
  return drawn_.at(next_ask_++).draw;
}

const Draw* Exploration::find(int rollout) const {
  const auto found = drawn_.find(rollout);
  return found == drawn_.end() || rollout >= next_ask_ ? nullptr : &found->second.draw;
}

const SearchDistribution* Exploration::drawn_from(int rollout) const {
  return find(rollout) ? drawn_.at(rollout).from.get() : nullptr;
}

void Exploration::tell(int rollout, const Outcome& outcome) {
  tell_but_switch(rollout, outcome);
  if (is_at_switch()) make_switch();
}

void Exploration::tell_but_switch(int rollout, const Outcome& outcome) {
  CHECK(!is_at_switch(), "a switch is to be made before more is told");
  const auto told = drawn_.find(rollout);
  CHECK(told != drawn_.end() && rollout < next_ask_,
        "a result was told twice or without having been asked for");
  const double reward = outcome.reward();
  CHECK(std::isfinite(reward) && reward >= 0, "a reward must be finite and not negative");
  Pending pending = std::move(told->second);
  Draw& draw = pending.draw;
  drawn_.erase(told);

  ++num_told_;
  keep_if_best(draw, reward);
  // The result of a layer that has been left, or of a run that has stopped, is recorded above,
  // never learnt from.
  if (draw.layer == layer() && !stopped_) {
    search_.learn({{rollout, reward, std::move(draw.theta)}, std::move(pending.from)}, num_told_);
  }
  if (stopped_ || stops_after(reward)) {
    stopped_ = true;
    return;
  }
  if (draw.layer == layer() && layer() < settings_.last_layer && search_.has_converged(settings_)) {
    leaves_after_ = rollout;
    return;
  }
  draw_what_is_permitted();
}

void Exploration::make_switch() {
  CHECK(is_at_switch(), "no layer has ended");
  const int rollout = *std::exchange(leaves_after_, std::nullopt);
  const double slope = search_.reward_slope().value_or(0);
  if (go_to_next_layer()) {
    switches_.push_back(rollout);
    slopes_at_switches_.push_back(slope);
  }
  draw_what_is_permitted();
}

bool Exploration::stops_after(double reward) const {
  if (settings_.stop_at_reward && reward >= *settings_.stop_at_reward) return true;
  return settings_.stop_on_convergence && layer() == settings_.last_layer &&
         search_.has_converged(settings_);
}

void Exploration::keep_if_best(const Draw& draw, double reward) {
  const bool is_best = best_.rollout < 0 || reward > best_.reward ||
                       (reward == best_.reward && draw.rollout < best_.rollout);
  if (is_best) best_ = {draw.rollout, draw.layer, reward, draw.theta};
}

bool Exploration::go_to_next_layer() {
  const UpdateRule& rule = search_.rule();
  const Eigen::VectorXd carried = settings_.reuse ? rule.carried_theta() : rule.distribution().mean;
  try {
    NextLayer next = policies_.back()->next_layer(carried);
    static_cast<void>(next.policy->controller());  // what workers make of it
    search_ = LayerSearch(settings_, settings_.reuse ? start_with_experience(settings_, rule, next,
                                                                             carried, num_told_)
                                                     : fresh_start(settings_, *next.policy));
    policies_.push_back(std::move(next.policy));
    return true;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

void Exploration::draw_what_is_permitted() {
  // Roll-out i needs i - in_flight + 1 results; written so that no sum can overflow.
  while (next_draw_ < settings_.num_rollouts && next_draw_ - num_told_ < settings_.in_flight &&
         search_.may_draw()) {
    const RandomStream stream(seed_, repetition_, static_cast<std::uint32_t>(next_draw_),
                              RandomPurpose::kPerturbation);
    LayerSearch::Drawn drawn = search_.draw(stream);
    drawn_.emplace(next_draw_,
                   Pending{{next_draw_, layer(), std::move(drawn.theta)}, std::move(drawn.from)});
    ++next_draw_;
  }
}

bool Exploration::done() const {
  if (is_at_switch()) return false;
  return stopped_ ? drawn_.empty() : num_told_ == settings_.num_rollouts;
}

const Policy& Exploration::policy(int layer) const {
  CHECK(settings_.first_layer <= layer && layer <= this->layer(), "this layer has not begun");
  return *policies_[static_cast<std::size_t>(layer - settings_.first_layer)];
}

}  // namespace treeroll::explore
