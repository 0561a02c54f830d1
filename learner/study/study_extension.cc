#include "learner/study/study_extension.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>

#include "learner/study/study_document.h"
#include "learner/study/toml_source.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 3> kMayGrow = {"study.rollouts", "study.repetitions",
                                                      "study.stop_after_s"};

constexpr const char* kMayGrowRule =
    "once a study has begun, only study.rollouts, study.repetitions and study.stop_after_s may "
    "change, and only to more";

/// By condition.
std::vector<json> settings_of(const std::filesystem::path& file,
                              const std::vector<std::string>& overrides) {
  const StudyDocument document(file, overrides);
  std::vector<json> settings(document.num_conditions());
  for (std::size_t i = 0; i < settings.size(); ++i) document.settings(i, settings[i]);
  return settings;
}

std::string as_text(std::optional<Duration> stop_after) {
  return stop_after ? fmt::format("{}", to_seconds(*stop_after)) : "no end";
}

void add(std::string& text, std::string_view key, const std::string& before,
         const std::string& after, const std::string& where = "") {
  if (before == after) return;
  text += fmt::format("{}{} from {} to {}{}", text.empty() ? "" : ", ", key, before, after, where);
}

}  // namespace

LoadedStudy load_extended(const std::filesystem::path& file,
                          const std::vector<std::string>& overrides) {
  std::vector<std::string> growing;
  std::vector<json> before;
  for (const std::string& assignment : overrides) {
    const SettingOverride setting = parse_override(assignment);
    const std::string key = fmt::format("{}", fmt::join(setting.key, "."));
    if (std::find(kMayGrow.begin(), kMayGrow.end(), key) != kMayGrow.end()) {
      growing.push_back(assignment);
      continue;
    }
    if (before.empty()) before = settings_of(file, {});
    if (settings_of(file, {assignment}) == before) continue;
    throw StudyError(kCommandLineOrigin, ConfigError(key, setting.text, kMayGrowRule));
  }
  return load_resolved_study(file, growing);
}

void check_extends(const LoadedStudy& before, const LoadedStudy& after,
                   const std::string& location) {
  const auto refuse = [&location](const char* key, const std::string& value,
                                  const std::string& rule) {
    throw StudyError(location, ConfigError(key, value, rule));
  };
  if (after.lasting_id != before.lasting_id) refuse("", "", kMayGrowRule);
  const auto must_not_shrink = [](const std::string& value, const std::string& where = "") {
    return fmt::format("must be at least {}, which the study has begun with{}", value, where);
  };
  if (after.study.repetitions < before.study.repetitions) {
    refuse("study.repetitions", std::to_string(after.study.repetitions),
           must_not_shrink(std::to_string(before.study.repetitions)));
  }
  const std::optional<Duration> end_before = before.study.stop_after;
  const std::optional<Duration> end_after = after.study.stop_after;
  if (!end_before && end_after) {
    refuse("study.stop_after_s", as_text(end_after),
           "the study has begun without an end in time: its journal has not counted the time");
  }
  // Without an end the runs would go on that had ended by it.
  if (end_before && (!end_after || *end_after < *end_before)) {
    refuse("study.stop_after_s", as_text(end_after), must_not_shrink(as_text(end_before)));
  }
  for (std::size_t i = 0; i < before.study.conditions.size(); ++i) {
    const int had = before.study.conditions[i].exploration.num_rollouts;
    const int has = after.study.conditions[i].exploration.num_rollouts;
    if (has >= had) continue;
    refuse("study.rollouts", std::to_string(has),
           must_not_shrink(std::to_string(had),
                           fmt::format(" (condition {})", before.study.conditions[i].name)));
  }
}

std::string describe_extension(const Study& before, const Study& after) {
  std::string text;
  add(text, "study.repetitions", std::to_string(before.repetitions),
      std::to_string(after.repetitions));
  add(text, "study.stop_after_s", as_text(before.stop_after), as_text(after.stop_after));
  const auto rollouts = [](const Study& study, std::size_t condition) {
    return study.conditions[condition].exploration.num_rollouts;
  };
  bool all_alike = true;
  for (std::size_t i = 1; i < after.conditions.size(); ++i) {
    all_alike = all_alike && rollouts(before, i) == rollouts(before, 0) &&
                rollouts(after, i) == rollouts(after, 0);
  }
  const std::size_t num_told = all_alike ? 1 : after.conditions.size();
  for (std::size_t i = 0; i < num_told; ++i) {
    add(text, "study.rollouts", std::to_string(rollouts(before, i)),
        std::to_string(rollouts(after, i)),
        all_alike ? "" : fmt::format(" (condition {})", after.conditions[i].name));
  }
  return text;
}

}  // namespace treeroll
