#include "learner/explore/exploration.h"

#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "learner/explore/experience.h"

namespace treeroll {
namespace {

ExplorationSettings checked(ExplorationSettings settings, const TreeModel& start,
                            ThetaLayout layout) {
  const Gmm coarsest = start.layer(1);
  const int component_dim =
      theta_dim_per_component(layout, coarsest.input_dim(), coarsest.output_dim());
  CHECK(settings.num_rollouts >= 1, "a run needs a roll-out");
  CHECK(settings.in_flight >= 1, "nothing could ever be drawn");
  CHECK(settings.best_considered <= settings.first_update, "I exceeds S_init");
  CHECK(1 <= settings.first_layer && settings.first_layer <= settings.last_layer &&
            settings.last_layer <= start.num_layers(),
        "layers to explore outside the tree");
  CHECK(settings.noise_variance.size() == static_cast<std::size_t>(component_dim),
        "noise_variance does not fit the layout of theta");
  return settings;
}

}  // namespace

Exploration::Exploration(ExplorationSettings settings, TreeModel start, ThetaLayout layout,
                         std::uint64_t seed, std::uint32_t repetition)
    : settings_(checked(std::move(settings), start, layout)),
      seed_(seed),
      repetition_(repetition),
      policies_{Policy{std::move(start), settings_.first_layer, layout}},
      search_(settings_, policies_.back().theta()) {
  draw_what_is_permitted();
}

std::optional<Draw> Exploration::ask() {
  if (next_ask_ == next_draw_) return std::nullopt;
  return drawn_.at(next_ask_++);
}

void Exploration::tell(int rollout, double reward, RolloutStatus status) {
  const auto told = drawn_.find(rollout);
  CHECK(told != drawn_.end() && rollout < next_ask_,
        "a result was told twice or without having been asked for");
  CHECK(status != RolloutStatus::kOk || (std::isfinite(reward) && reward >= 0),
        "a reward must be finite and not negative");
  Draw draw = std::move(told->second);
  drawn_.erase(told);

  const double counted = status == RolloutStatus::kOk ? reward : 0;
  ++num_told_;
  keep_if_best(draw, counted);
  // The result of a layer that has been left is recorded above, never learnt from.
  if (draw.layer == layer()) {
    search_.learn(settings_, {rollout, counted, std::move(draw.theta)}, num_told_);
    if (layer() < settings_.last_layer && search_.has_converged(settings_)) {
      switches_.push_back(rollout);
      go_to_next_layer();
    }
  }
  draw_what_is_permitted();
}

void Exploration::keep_if_best(const Draw& draw, double reward) {
  const bool is_best = best_.rollout < 0 || reward > best_.reward ||
                       (reward == best_.reward && draw.rollout < best_.rollout);
  if (is_best) best_ = {draw.rollout, draw.layer, reward, draw.theta};
}

void Exploration::go_to_next_layer() {
  const Policy& left = policies_.back();
  policies_.push_back({left.tree_with(mean()), left.layer + 1, left.layout});
  const Policy& next = policies_.back();
  LayerSearch search(settings_, next.theta());
  if (settings_.reuse) {
    search.reuse(settings_, project_experience(left, next, search_.history()),
                 experience_jacobian(left, next, mean(), noise().diagonal().cwiseSqrt()),
                 num_told_);
  }
  search_ = std::move(search);
}

void Exploration::draw_what_is_permitted() {
  // Roll-out i needs i - in_flight + 1 results; written so that no sum can overflow.
  while (next_draw_ < settings_.num_rollouts && next_draw_ - num_told_ < settings_.in_flight) {
    const RandomStream stream(seed_, repetition_, static_cast<std::uint32_t>(next_draw_),
                              RandomPurpose::kPerturbation);
    drawn_.emplace(next_draw_, Draw{next_draw_, layer(), search_.draw(stream)});
    ++next_draw_;
  }
}

bool Exploration::done() const { return num_told_ == settings_.num_rollouts; }

const Policy& Exploration::policy(int layer) const {
  CHECK(settings_.first_layer <= layer && layer <= this->layer(), "this layer has not begun");
  return policies_[static_cast<std::size_t>(layer - settings_.first_layer)];
}

}  // namespace treeroll
