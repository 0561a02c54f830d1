// Runs: a table of them, and one with all that is to be seen of it.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "learner/web/views/policy_view.h"
#include "learner/web/views/view_text.h"
#include "learner/web/views/views.h"

namespace treeroll::web {
namespace {

using learner::Run;
using nlohmann::json;

constexpr std::size_t kRunsPerPage = 50;
constexpr std::size_t kRewardPointsMax = 600;
constexpr Eigen::Index kDeviationsMax = 200;

double best_of(const Run& run) {
  const explore::Exploration::Best& best = run.exploration().best();
  return best.rollout >= 0 ? best.reward : -1;
}

const Condition& condition_of(const LiveStudy& study, const Run& run) {
  return study.core().study().conditions[static_cast<std::size_t>(run.condition())];
}

json row_of(const LiveStudy& study, const Run& run) {
  const explore::Exploration& exploration = run.exploration();
  const Eigen::MatrixXd& noise = exploration.noise();
  json row{{"run", run.index()},
           {"condition", condition_of(study, run).name},
           {"repetition", run.repetition()},
           {"layer", exploration.layer()},
           {"applied", exploration.num_told()},
           {"rollouts", condition_of(study, run).exploration.num_rollouts},
           {"failed", run.num_failed()},
           {"discarded", run.num_discarded()},
           {"last", run.last_reward()},
           {"best", nullptr},
           {"best_rollout", exploration.best().rollout},
           {"mean", nullptr},
           {"noise", std::sqrt(noise.trace() / static_cast<double>(noise.rows()))},
           {"done", run.done()}};
  if (exploration.best().rollout >= 0) row["best"] = exploration.best().reward;
  if (const auto mean = exploration.mean_reward()) row["mean"] = *mean;
  return row;
}

/// Rewards over roll-outs; neighbours share a point. A point without a result is null.
json rewards_view(const std::vector<RolloutRecord>& rollouts) {
  const std::size_t width =
      std::max<std::size_t>(1, (rollouts.size() + kRewardPointsMax - 1) / kRewardPointsMax);
  json view{{"rollouts_per_point", width}};
  for (const char* name : {"rollout", "mean", "low", "high", "failed", "layer"}) {
    view[name] = json::array();
  }
  for (std::size_t begin = 0; begin < rollouts.size(); begin += width) {
    const std::size_t end = std::min(begin + width, rollouts.size());
    double sum = 0;
    double low = 0;
    double high = 0;
    int count = 0;
    int failed = 0;
    int layer = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const RolloutRecord& record = rollouts[i];
      if (record.layer == 0) continue;
      layer = record.layer;
      if (record.status != RolloutStatus::kOk) ++failed;
      low = count == 0 ? record.reward : std::min(low, record.reward);
      high = count == 0 ? record.reward : std::max(high, record.reward);
      sum += record.reward;
      ++count;
    }
    view["rollout"].push_back(static_cast<double>(begin + end + 1) / 2);
    view["mean"].push_back(count > 0 ? json(sum / count) : json(nullptr));
    view["low"].push_back(count > 0 ? json(low) : json(nullptr));
    view["high"].push_back(count > 0 ? json(high) : json(nullptr));
    view["failed"].push_back(failed);
    view["layer"].push_back(layer);
  }
  return view;
}

/// The policy of the current mean, and what would be drawn around it.
json now_view(const Run& run) {
  const explore::Exploration& exploration = run.exploration();
  const Policy& policy = exploration.policy(exploration.layer());
  const Eigen::VectorXd deviations = exploration.noise().diagonal().cwiseSqrt();
  json view{{"policy", nullptr},
            {"theta_dim", exploration.mean().size()},
            {"noise", noise_view(policy, exploration.mean(), exploration.noise())},
            {"deviations", json::array()}};
  for (Eigen::Index i = 0; i < std::min(deviations.size(), kDeviationsMax); ++i) {
    view["deviations"].push_back(deviations[i]);
  }
  try {
    view["policy"] = policy_view(*policy.with(exploration.mean()));
  } catch (const std::invalid_argument&) {
    view["policy"] = nullptr;  // the noise has driven theta to where no policy is
  }
  return view;
}

json outcome_view(const std::optional<learner::Answer>& answer) {
  if (!answer) return nullptr;
  return {{"reward", answer->outcome.reward()},
          {"status", name(answer->outcome.status())},
          {"reason", answer->outcome.reason()}};
}

/// Of the evaluations of the final policy that are in: their mean is what it is worth, as in
/// runs.csv. Null before the first; no reward where all are void.
json final_view(const Run& run, int num_evaluations) {
  std::vector<Outcome> outcomes;
  for (int i = 0; i < num_evaluations; ++i) {
    const auto answer = run.answer_of(Run::final_number(i));
    if (answer) outcomes.push_back(answer->outcome);
  }
  if (outcomes.empty()) return nullptr;
  const std::optional<double> reward = mean_reward(outcomes);
  const auto num_ok = std::ranges::count_if(outcomes, &Outcome::is_ok);
  // Where some failed, one of them says why.
  const Outcome& shown = *std::ranges::min_element(outcomes, {}, &Outcome::is_ok);
  return {{"reward", reward ? json(*reward) : json(nullptr)},
          {"status", name(shown.status())},
          {"reason", shown.reason()},
          {"evaluations", outcomes.size()},
          {"wanted", num_evaluations},
          {"failed", static_cast<std::int64_t>(outcomes.size()) - num_ok}};
}

}  // namespace

std::string runs_view(const LiveStudy& study, const RunsQuery& query) {
  std::vector<const Run*> chosen;
  for (const Run& run : study.core().runs()) {
    if (!query.condition || run.condition() == *query.condition) chosen.push_back(&run);
  }
  const auto sort = [&](const auto& key) {
    std::stable_sort(chosen.begin(), chosen.end(),
                     [&](const Run* a, const Run* b) { return key(*a) > key(*b); });
  };
  if (query.order == "best") sort(best_of);
  if (query.order == "worst") sort([](const Run& run) { return -best_of(run); });
  if (query.order == "failed") sort([](const Run& run) { return run.num_failed(); });
  json view{{"num", chosen.size()}, {"from", query.from}, {"per_page", kRunsPerPage}};
  view["runs"] = json::array();
  const auto from = std::min(chosen.size(), static_cast<std::size_t>(std::max(0, query.from)));
  for (std::size_t i = from; i < std::min(chosen.size(), from + kRunsPerPage); ++i) {
    view["runs"].push_back(row_of(study, *chosen[i]));
  }
  return dumped(view);
}

std::string run_view(const LiveStudy& study, int run_index) {
  const Run& run = study.core().runs()[static_cast<std::size_t>(run_index)];
  json view = row_of(study, run);
  view["condition_index"] = run.condition();
  view["rewards"] = rewards_view(run.rollouts());
  view["switches"] = run.exploration().switches();
  view["reasons"] = run.reasons();
  view["start"] = outcome_view(run.answer_of(Run::kStart));
  view["final"] = final_view(run, study.core().study().final_evaluations);
  view["now"] = now_view(run);
  return dumped(view);
}

}  // namespace treeroll::web
