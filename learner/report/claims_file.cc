#include "learner/report/claims_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>

#include "common/settings/settings_reader.h"
#include "learner/study/study_error.h"
#include "learner/study/toml_source.h"

namespace treeroll::report {
namespace {

using nlohmann::json;

constexpr std::size_t kConditionsMax = 100;
constexpr int kRolloutMax = 100'000'000;

Measure read_measure(SettingsReader& reader) {
  static const std::map<std::string, MeasureKind> kKinds = {
      {"near", MeasureKind::kNear},
      {"mean", MeasureKind::kMean},
      {"best", MeasureKind::kBest},
      {"final", MeasureKind::kFinal},
      {"switch", MeasureKind::kSwitch},
      {"before_switch", MeasureKind::kBeforeSwitch},
      {"after_switch", MeasureKind::kAfterSwitch},
      {"drop", MeasureKind::kDrop},
      {"gain", MeasureKind::kGain},
      {"steepest", MeasureKind::kSteepest},
      {"log_likelihood", MeasureKind::kLogLikelihood}};
  Measure measure;
  measure.kind =
      kKinds.at(reader.choice("measure",
                              {"near", "mean", "best", "final", "switch", "before_switch",
                               "after_switch", "drop", "gain", "steepest", "log_likelihood"},
                              "near"));
  const bool has_place = measure.kind == MeasureKind::kNear || measure.kind == MeasureKind::kMean ||
                         measure.kind == MeasureKind::kBest || measure.kind == MeasureKind::kGain ||
                         measure.kind == MeasureKind::kSteepest;
  if (has_place) measure.rollout = static_cast<int>(reader.integer("rollout", 1, kRolloutMax));
  if (measure.kind == MeasureKind::kNear && measure.rollout < 5) {
    reader.refuse("rollout", "must be at least 5: near means the five roll-outs up to it");
  }
  if (measure.kind == MeasureKind::kGain && measure.rollout < 5) {
    reader.refuse("rollout", "must be at least 5: a gain is of the mean of five roll-outs");
  }
  if (measure.kind == MeasureKind::kSteepest && measure.rollout < 55) {
    reader.refuse("rollout", "must be at least 55: the means of five roll-outs, 50 apart");
  }
  if (measure.kind == MeasureKind::kMean) {
    measure.from = static_cast<int>(reader.integer("from", 1, measure.rollout));
  }
  return measure;
}

void read_kind(SettingsReader& reader, Claim& claim) {
  std::vector<std::string_view> kinds;
  for (const auto& [name, kind] : kClaimKinds) kinds.push_back(name);
  const std::string chosen = reader.choice("kind", kinds);
  claim.kind = std::ranges::find(kClaimKinds, std::string_view(chosen), [](const auto& named) {
                 return named.first;
               })->second;
  switch (claim.kind) {
    case ClaimKind::kGreater:
      claim.paired = reader.boolean("paired", false);
      claim.margin = reader.number("margin", kAnyNumber, 0);
      break;
    case ClaimKind::kHighest:
    case ClaimKind::kLowest:
      claim.margin = reader.number("margin", {.min = 0}, 0);
      break;
    case ClaimKind::kEqualWithin:
    case ClaimKind::kEqualMedians:
      claim.margin = reader.number("margin", kPositive);
      break;
    case ClaimKind::kShare:
      claim.share_min = reader.number("share_min", {.min = 0, .max = 1}, 0);
      claim.share_max = reader.number("share_max", {.min = claim.share_min, .max = 1}, 1);
      [[fallthrough]];
    case ClaimKind::kWithin:
    case ClaimKind::kDeviation:
      claim.low = reader.number("low", kAnyNumber);
      claim.high = reader.number("high", {.min = claim.low});
      break;
    case ClaimKind::kSpread:
      claim.others = reader.strings("others", kConditionsMax);
      break;
    default:
      break;
  }
}

void check_conditions(SettingsReader& reader, const Claim& claim) {
  const std::size_t count = claim.conditions.size();
  if (claim.kind == ClaimKind::kGreater && count != 2) {
    reader.refuse("conditions", "must be two: the first is claimed to be greater");
  }
  const bool is_one = claim.kind == ClaimKind::kWithin || claim.kind == ClaimKind::kDeviation;
  if (is_one && count != 1) reader.refuse("conditions", "must be one");
  const bool alone = is_one || claim.kind == ClaimKind::kShare;
  if (!alone && count < 2) reader.refuse("conditions", "must be at least two");
  if (claim.kind == ClaimKind::kSpread && claim.others.size() != count) {
    reader.refuse("others", fmt::format("must be {}, as many as conditions: a spread grows with "
                                        "their number",
                                        count));
  }
}

/// A claim that is made once has no place for a word: nothing would be put there.
void check_no_place(SettingsReader& reader, const Claim& claim) {
  const auto check = [&](const char* key, const std::string& text) {
    if (text.find("{}") == std::string::npos) return;
    reader.refuse(key, "has {}, for which each must list words");
  };
  check("text", claim.text);
  check("figure", claim.figure);
  for (const std::string& condition : claim.conditions) check("conditions", condition);
  for (const std::string& condition : claim.others) check("others", condition);
}

std::string put(std::string text, const std::string& word) {
  for (std::size_t at = text.find("{}"); at != std::string::npos;
       at = text.find("{}", at + word.size())) {
    text.replace(at, 2, word);
  }
  return text;
}

Claim for_word(Claim claim, const std::string& word) {
  claim.text = put(claim.text, word);
  claim.figure = put(claim.figure, word);
  for (std::string& condition : claim.conditions) condition = put(condition, word);
  for (std::string& condition : claim.others) condition = put(condition, word);
  return claim;
}

void read_claim(SettingsReader& reader, std::vector<Claim>& claims) {
  Claim claim;
  claim.text = reader.string("text");
  claim.section = reader.string("section");
  claim.study = reader.string("study");
  claim.conditions = reader.strings("conditions", kConditionsMax);
  claim.figure = reader.string("figure", "");
  read_kind(reader, claim);
  claim.measure = read_measure(reader);
  claim.against = claim.measure;
  if (reader.has("against")) {
    SettingsReader against = reader.table("against");
    claim.against = read_measure(against);
    against.finish();
  }
  std::vector<std::string> words;
  if (reader.has("each")) words = reader.strings("each", kConditionsMax);
  reader.finish();
  check_conditions(reader, claim);
  if (words.empty()) {
    check_no_place(reader, claim);
    claims.push_back(claim);
  }
  for (const std::string& word : words) claims.push_back(for_word(claim, word));
}

}  // namespace

std::vector<Claim> read_claims(const std::filesystem::path& path) {
  json content;
  const SettingOrigins origins = read_toml_file(path, content, "one of [[claims]]");
  try {
    for (const auto& [key, value] : content.items()) {
      if (key != "claims" || !value.is_array() || value.empty()) {
        throw ConfigError(key, "", "a file of claims holds [[claims]] and nothing else");
      }
    }
    std::vector<Claim> claims;
    for (std::size_t i = 0; i < content["claims"].size(); ++i) {
      const std::string key = "claims[" + std::to_string(i) + "]";
      if (!content["claims"][i].is_object()) throw ConfigError(key, "", "must be a table");
      json resolved;
      SettingsReader reader(content["claims"][i], key, resolved);
      read_claim(reader, claims);
    }
    return claims;
  } catch (const ConfigError& error) {
    throw StudyError(origin_of(origins, error.key()), error);
  }
}

}  // namespace treeroll::report
