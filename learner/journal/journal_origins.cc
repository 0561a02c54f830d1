#include "learner/journal/journal_origins.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace treeroll {

void JournalOrigins::add(const JournalRecord& record) {
  if (const auto* start = std::get_if<JournalStart>(&record)) {
    programs_.insert(start->format == 1 ? "0.1.0" : start->program);
  } else if (const auto* worker = std::get_if<KnownWorker>(&record)) {
    classes_[worker->worker_id] = worker->numeric_class;
  } else if (const auto* result = std::get_if<AcceptedResult>(&record)) {
    const auto known = classes_.find(result->worker_id);
    ++results_[known == classes_.end() ? std::string() : known->second];
  }
}

std::string class_list(const std::map<std::string, std::int64_t>& results_by_class) {
  std::vector<std::pair<std::int64_t, std::string>> sorted;
  for (const auto& [name, count] : results_by_class) {
    std::string shown = name.empty() ? "not known" : name;
    std::replace_if(
        shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    sorted.emplace_back(-count, std::move(shown));
  }
  std::sort(sorted.begin(), sorted.end());
  std::string text;
  for (const auto& [negative, name] : sorted) {
    text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", name, -negative);
  }
  return text;
}

}  // namespace treeroll
