#pragma once

#include <concepts>
#include <memory>
#include <utility>

#include "learner/explore/update_rule.h"

namespace treeroll::explore {

/// What the settings of an update rule are: values that make the rule at the start of a layer.
template <typename Settings>
concept MakesUpdateRule = std::equality_comparable<Settings> &&
    requires(const Settings& settings, LayerStart start) {
  { make_rule(settings, std::move(start)) } -> std::same_as<std::unique_ptr<UpdateRule>>;
};

/// The settings of one update rule, whichever it is. Immutable; copies share. Equal if both are of
/// the same rule and equal.
///
///   RuleSettings rule = PowerSettings{.first_update = 5, .best_considered = 3};
///   std::unique_ptr<UpdateRule> of_layer = rule.make(start);
class RuleSettings {
 public:
  template <MakesUpdateRule Settings>
  RuleSettings(Settings settings)  // NOLINT(google-explicit-constructor): it is what it holds
      : held_(std::make_shared<Held<Settings>>(std::move(settings))) {}

  /// The rule at the start of a layer.
  std::unique_ptr<UpdateRule> make(LayerStart start) const { return held_->make(std::move(start)); }
  friend bool operator==(const RuleSettings& a, const RuleSettings& b) {
    return a.held_->equals(*b.held_);
  }

 private:
  struct Any {
    virtual ~Any() = default;
    virtual std::unique_ptr<UpdateRule> make(LayerStart start) const = 0;
    virtual bool equals(const Any& other) const = 0;
  };
  template <typename Settings>
  struct Held final : Any {
    explicit Held(Settings held) : settings(std::move(held)) {}
    std::unique_ptr<UpdateRule> make(LayerStart start) const override {
      return make_rule(settings, std::move(start));
    }
    bool equals(const Any& other) const override {
      const auto* same = dynamic_cast<const Held*>(&other);
      return same != nullptr && settings == same->settings;
    }
    Settings settings;
  };

  std::shared_ptr<const Any> held_;
};

}  // namespace treeroll::explore
