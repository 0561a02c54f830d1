#include "common/policy/policy_registry.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/base/check.h"
#include "common/base/json_text.h"
#include "common/policy/policy_bounds.h"
#include "common/settings/settings_reader.h"

namespace treeroll {
namespace {

using nlohmann::json;

/// policy > attractor > layers > layer > component > mean; parse depth counts from 0.
constexpr int kNestingMax = 6;
/// What a text may hold; a policy is a small thing.
constexpr std::size_t kTextBytesMax = std::size_t{1} << 20;

json parse(std::string_view text) {
  if (text.size() > kTextBytesMax) {
    throw PolicyTextError(
        "the text", fmt::format("has {} bytes, must have at most {}", text.size(), kTextBytesMax));
  }
  Result<json> value = parse_json(text, kNestingMax);
  if (!value) throw PolicyTextError("the text", value.error().message);
  return std::move(*value);
}

SignalNames read_signals(const PolicyText& content, const Policy& policy) {
  content.need_keys({"inputs", "outputs"});
  SignalNames names{content.at("inputs").strings(kSignalsMax),
                    content.at("outputs").strings(kSignalsMax)};
  if (names.empty()) throw PolicyTextError("$.signals", "must name inputs and outputs");
  if (const auto fault = fault_of(names, policy.input_dim(), policy.output_dim())) {
    throw PolicyTextError("$.signals", "are wrong: " + *fault);
  }
  return names;
}

}  // namespace

void PolicyRegistry::add(std::string kind, PolicyMaker make, StartReader start) {
  CHECK(!kind.empty() && !kinds_.contains(kind), "the name of a kind is new: " + kind);
  kinds_.emplace(std::move(kind), Kind{std::move(make), std::move(start)});
}

void PolicyRegistry::set_start(std::string_view kind, StartReader start) {
  const auto found = kinds_.find(kind);
  CHECK(found != kinds_.end() && !found->second.start, "a kind without a start");
  found->second.start = std::move(start);
}

void PolicyRegistry::add_choice(std::string name, StartReader start) {
  CHECK(start, "a choice is read");
  add(std::move(name), {}, std::move(start));
}

Result<PolicyPtr> PolicyRegistry::from_json(std::string_view text) const {
  Result<NamedPolicy> named = named_from_json(text);
  if (!named) return named.error();
  return std::move(named->policy);
}

Result<NamedPolicy> PolicyRegistry::named_from_json(std::string_view text) const {
  try {
    return read(text);
  } catch (const PolicyTextError& error) {
    return Error{error.what()};
  }
}

NamedPolicy PolicyRegistry::read(std::string_view text) const {
  json value = parse(text);
  // The version comes first: another version may have other keys.
  if (!value.is_object() || !value.contains("format") || value["format"] != kPolicyFormat) {
    throw PolicyTextError("$.format", fmt::format("must be \"{}\"", kPolicyFormat));
  }
  if (!value.contains("version") || value["version"] != kPolicyVersion) {
    throw PolicyTextError("$.version", fmt::format("must be {}", kPolicyVersion));
  }
  std::string kind(kDefaultPolicyKind);
  if (value.contains("kind")) {
    if (!value["kind"].is_string()) throw PolicyTextError("$.kind", "must be a string");
    kind = value["kind"].get<std::string>();
  }
  const auto found = kinds_.find(kind);
  if (found == kinds_.end() || !found->second.make) {
    throw PolicyTextError("$.kind", "must be one of: " + known());
  }
  const auto taken = [&](const char* key) {  // null is there, and refused
    return value.contains(key) ? std::optional<json>(value[key]) : std::nullopt;
  };
  const std::optional<json> bounds = taken("bounds");
  const std::optional<json> signals = taken("signals");
  for (const char* head : {"format", "version", "kind", "bounds", "signals"}) value.erase(head);
  PolicyPtr policy = found->second.make(PolicyText(value, "$"));
  if (bounds) {
    policy = bounded(policy, bounds_from_content(PolicyText(*bounds, "$.bounds"), *policy));
  }
  NamedPolicy named{policy, {}};
  if (signals) named.signals = read_signals(PolicyText(*signals, "$.signals"), *policy);
  return named;
}

StartPolicy PolicyRegistry::read_start(SettingsReader& policy, const StartSources& sources) const {
  // Asked for only where it stands: a resolved study names the kinds it named before.
  std::string kind(kDefaultPolicyKind);
  if (policy.has("kind")) {
    std::vector<std::string_view> names;
    for (const auto& [name, of_name] : kinds_) names.push_back(name);
    const std::string otherwise = fmt::format("\"{}\"", kDefaultPolicyKind);
    kind = policy.choice("kind", names, {},
                         {.meaning = "What represents the policy: a tree of Gaussian mixtures, or "
                                     "another kind; the other keys are the kind's",
                          .otherwise = otherwise});
  }
  const auto found = kinds_.find(kind);
  CHECK(found->second.start, "no way to start a policy of kind " + kind);
  StartSources unbounded = sources;
  StartPolicy fitted;
  if (sources.fitted != nullptr) {
    fitted = *sources.fitted;
    fitted.policy = without_bounds(fitted.policy);
    unbounded.fitted = &fitted;
  }
  StartPolicy start = found->second.start(policy, unbounded);
  if (policy.has("bounds")) {
    start.policy = bounded(start.policy, read_policy_bounds(policy.table("bounds"), start.policy));
  }
  return start;
}

std::string PolicyRegistry::known() const {
  std::string names;
  for (const auto& [name, kind] : kinds_) {
    if (!kind.make) continue;
    names += (names.empty() ? "" : ", ") + name;
  }
  return names;
}

}  // namespace treeroll
