// The table of roll-outs.
#include <fmt/format.h>

#include <charconv>
#include <nlohmann/json.hpp>
#include <string_view>

#include "learner/web/views/view_text.h"
#include "learner/web/views/views.h"

namespace treeroll::web {
namespace {

using learner::Run;
using nlohmann::json;

constexpr std::size_t kRolloutsPerPage = 100;
/// A look at more of them takes too long at once; the page goes on where it ended.
constexpr std::int64_t kLookedAtMax = 300'000;

bool fits(const RolloutRecord& record, const RolloutsQuery& query) {
  if (record.layer == 0) return false;  // no result yet
  if (query.layer && record.layer != *query.layer) return false;
  if (record.reward < query.reward_min) return false;
  if (query.status.empty()) return true;
  if (query.status == "failed") return record.status != RolloutStatus::kOk;
  return name(record.status) == query.status;
}

bool fits(const Run& run, const RolloutsQuery& query) {
  return (!query.condition || run.condition() == *query.condition) &&
         (!query.run || run.index() == *query.run);
}

json rollout_row(const LiveStudy& study, const Run& run, std::size_t number) {
  const RolloutRecord& record = run.rollouts()[number];
  const std::vector<std::string>& reasons = run.reasons();
  const bool is_filed = record.reason > 0 && record.reason <= reasons.size();
  const auto condition = static_cast<std::size_t>(run.condition());
  return {{"run", run.index()},
          {"condition", study.core().study().conditions[condition].name},
          {"repetition", run.repetition()},
          {"rollout", number},
          {"layer", record.layer},
          {"reward", record.reward},
          {"status", name(record.status)},
          {"reason", is_filed ? reasons[record.reason - 1U] : ""}};
}

struct Place {
  int run = 0;
  int number = 0;
};

/// The begin for what is no place.
Place place_of(std::string_view text) {
  Place place;
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return place;
  const auto read = [](std::string_view digits, int& value) {
    std::from_chars(digits.data(), digits.data() + digits.size(), value);
    value = std::max(0, value);
  };
  read(text.substr(0, colon), place.run);
  read(text.substr(colon + 1), place.number);
  return place;
}

void add_newest(const LiveStudy& study, const RolloutsQuery& query, json& view) {
  const auto& recent = study.recent();
  if (recent.size() == LiveStudy::kRecentMax) view["last"] = recent.size();
  for (auto key = recent.rbegin(); key != recent.rend(); ++key) {
    const Run& run = study.core().runs()[static_cast<std::size_t>(key->run)];
    const auto number = static_cast<std::size_t>(key->number);
    if (!fits(run, query) || !fits(run.rollouts()[number], query)) continue;
    if (view["rollouts"].size() == kRolloutsPerPage) {
      view["is_cut"] = true;
      return;
    }
    view["rollouts"].push_back(rollout_row(study, run, number));
  }
}

void add_by_number(const LiveStudy& study, const RolloutsQuery& query, json& view) {
  const std::vector<Run>& runs = study.core().runs();
  Place place = place_of(query.from);
  std::int64_t looked_at = 0;
  for (; place.run < static_cast<int>(runs.size()); place = {place.run + 1, 0}) {
    const Run& run = runs[static_cast<std::size_t>(place.run)];
    if (!fits(run, query)) continue;
    for (; place.number < static_cast<int>(run.rollouts().size()); ++place.number) {
      const auto number = static_cast<std::size_t>(place.number);
      if (view["rollouts"].size() == kRolloutsPerPage || looked_at++ == kLookedAtMax) {
        view["next"] = fmt::format("{}:{}", place.run, place.number);
        return;
      }
      if (fits(run.rollouts()[number], query)) {
        view["rollouts"].push_back(rollout_row(study, run, number));
      }
    }
  }
}

}  // namespace

std::string rollouts_view(const LiveStudy& study, const RolloutsQuery& query) {
  json view{{"rollouts", json::array()}, {"next", nullptr}, {"last", nullptr}, {"is_cut", false}};
  if (query.order == "number") {
    add_by_number(study, query, view);
  } else {
    add_newest(study, query, view);
  }
  return dumped(view);
}

}  // namespace treeroll::web
