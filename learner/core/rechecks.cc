#include "learner/core/rechecks.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/protocol/limits.h"

namespace treeroll::learner {
namespace {

bool contradict(const Opinion& a, const Opinion& b) { return is_one_class(a, b) && !agree(a, b); }

/// Two other witnesses of its class agree with each other, and no other witness of it with this
/// one: processes of one broken host agree, too.
bool is_outvoted_in(const Opinion& one, const std::vector<Opinion>& all) {
  std::vector<const Opinion*> against;
  for (const Opinion& other : all) {
    if (&other == &one || !is_one_class(one, other)) continue;
    if (!agree(one, other)) {
      against.push_back(&other);
    } else if (!are_one_witness(one.worker, other.worker)) {
      return false;
    }
  }
  return std::ranges::any_of(against, [&](const Opinion* a) {
    return std::ranges::any_of(against, [a](const Opinion* b) {
      return agree(*a, *b) && !are_one_witness(a->worker, b->worker);
    });
  });
}

}  // namespace

bool is_one_class(const Opinion& a, const Opinion& b) {
  return !a.worker.numeric_class.empty() && a.worker.numeric_class == b.worker.numeric_class;
}

bool agree(const Opinion& a, const Opinion& b) {
  if (is_one_class(a, b)) return a.outcome.agrees_with(b.outcome);
  const double difference = std::fabs(a.outcome.reward() - b.outcome.reward());
  const double larger = std::max(a.outcome.reward(), b.outcome.reward());
  return a.outcome.status() == b.outcome.status() &&
         difference <= kRewardShareBetweenClasses * larger;
}

std::optional<protocol::RolloutKey> Rechecks::open(protocol::RolloutKey key, Opinion first) {
  const bool is_new = open_.emplace(key, std::vector{std::move(first)}).second;
  CHECK(is_new, "a roll-out is run again once");
  row_.push_back(key);
  if (row_.size() <= protocol::kRechecksOpenMax) return std::nullopt;
  const protocol::RolloutKey oldest = row_.front();
  drop(oldest);
  return oldest;
}

Rechecks::News Rechecks::take(protocol::RolloutKey key, Opinion another) {
  const auto found = open_.find(key);
  CHECK(found != open_.end(), "only what is run again has a second answer");
  std::vector<Opinion>& opinions = found->second;
  News news;
  const bool was_undecided = opinions.size() > 1;  // else it were settled
  for (const Opinion& earlier : opinions) compare(earlier, another, news);
  if (!was_undecided) {
    ++record_.num_rechecked;
    record_.num_disputed += news.disagreements.empty() ? 0 : 1;
  }
  opinions.push_back(std::move(another));
  for (const Opinion& one : opinions) {
    std::vector<KnownWorker>& side = is_outvoted_in(one, opinions) ? news.outvoted : news.others;
    side.push_back(one.worker);
  }
  for (const KnownWorker& outvoted : news.outvoted) {
    if (RecheckedWorker* tally = tally_of(outvoted)) ++tally->num_outvoted;
  }
  const bool is_contradicted = std::ranges::any_of(opinions, [&](const Opinion& one) {
    return std::ranges::any_of(opinions, [&](const Opinion& b) { return contradict(one, b); });
  });
  const bool is_undecided = is_contradicted && news.outvoted.empty();
  record_.num_undecided += (is_undecided ? 1 : 0) - (was_undecided ? 1 : 0);
  news.wants_another = is_undecided && opinions.size() < protocol::kOpinionsMax;
  if (!news.wants_another) drop(key);
  return news;
}

void Rechecks::drop(protocol::RolloutKey key) {
  CHECK(open_.erase(key) == 1, "only what is run again is given up");
  row_.erase(std::ranges::find(row_, key));
}

bool Rechecks::is_outvoted(protocol::WorkerId worker) const {
  const auto found = record_.workers.find(worker);
  return found != record_.workers.end() && found->second.num_outvoted > 0;
}

void Rechecks::compare(const Opinion& a, const Opinion& b, News& news) {
  const bool differ = !agree(a, b);
  if (differ) news.disagreements.emplace_back(a, b);
  for (const Opinion* one : {&a, &b}) {
    RecheckedWorker* tally = tally_of(one->worker);
    if (!tally) continue;
    ++tally->num_compared;
    tally->num_disagreed += differ ? 1 : 0;
  }
  const auto names = std::minmax(a.worker.numeric_class, b.worker.numeric_class);
  const std::pair<std::string, std::string> classes(names.first, names.second);
  const bool is_full = record_.classes.size() >= protocol::kNumericClassesMax;
  if (is_full && !record_.classes.contains(classes)) return;
  RecheckedClasses& tally = record_.classes[classes];
  ++tally.num_compared;
  tally.num_disagreed += differ ? 1 : 0;
  tally.difference_max =
      std::max(tally.difference_max, std::fabs(a.outcome.reward() - b.outcome.reward()));
}

/// Names cost nothing to make up, and each start of a worker has another: of too many the one makes
/// room that was compared least, and was not outvoted. Null where all were.
RecheckedWorker* Rechecks::tally_of(const KnownWorker& worker) {
  const auto found = record_.workers.find(worker.worker_id);
  if (found != record_.workers.end()) return &found->second;
  if (record_.workers.size() >= protocol::kWorkersMax) {
    const auto least = std::ranges::min_element(record_.workers, {}, [](const auto& entry) {
      return std::pair(entry.second.num_outvoted, entry.second.num_compared);
    });
    if (least->second.num_outvoted > 0) return nullptr;
    record_.workers.erase(least);
  }
  return &record_.workers.emplace(worker.worker_id, RecheckedWorker{.worker = worker})
              .first->second;
}

}  // namespace treeroll::learner
