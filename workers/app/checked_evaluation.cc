#include "workers/app/checked_evaluation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <new>
#include <nlohmann/json.hpp>

#include "common/base/cut_text.h"
#include "workers/app/floating_point.h"
#include "workers/tasks/trace.h"

namespace treeroll::worker {

std::string bounded(const std::string& text, std::size_t bytes_max) {
  using nlohmann::json;
  const std::string quoted = json(text.substr(0, std::min(text.find('\0'), bytes_max)))
                                 .dump(-1, ' ', false, json::error_handler_t::replace);
  std::string bounded = cut_text(json::parse(quoted).get<std::string>(), bytes_max);
  // A line of a log or a table stays one, and a terminal obeys nobody's task.
  std::ranges::replace_if(
      bounded, [](unsigned char c) { return c < ' ' || c == 0x7f; }, ' ');
  return bounded;
}

Outcome failed(const std::string& reason) {
  return Outcome::failed(RolloutStatus::kFailed, bounded(reason, kOutcomeReasonBytesMax));
}

namespace {

Outcome checked(const Outcome& outcome, const TaskDescription& description) {
  if (!outcome.is_ok()) {
    return {0, outcome.status(), bounded(outcome.reason(), kOutcomeReasonBytesMax)};
  }
  const bool in_range = std::isfinite(outcome.reward()) &&
                        outcome.reward() >= description.reward_min &&
                        outcome.reward() <= description.reward_max;
  if (in_range) return outcome;
  return failed(fmt::format("the task's reward {} is outside its range {} .. {}", outcome.reward(),
                            description.reward_min, description.reward_max));
}

}  // namespace

Outcome evaluate_checked(Task& task, const TaskDescription& description, Controller& controller,
                         std::uint64_t seed, Trace* trace) {
  const StandardFloatingPoint standard;
  try {
    return checked(trace == nullptr ? task.evaluate(controller, seed)
                                    : task.evaluate_traced(controller, seed, *trace),
                   description);
  } catch (const std::bad_alloc&) {
    throw;  // a want of this host, not of the roll-out: the process ends, and another tries
  } catch (const std::exception& error) {
    return failed(error.what());
  } catch (...) {
    return failed("the task threw what is no std::exception");
  }
}

std::optional<std::vector<Outcome>> evaluate_all_checked(
    Task& task, const TaskDescription& description, std::span<const Task::Evaluation> evaluations) {
  const StandardFloatingPoint standard;
  try {
    std::vector<Outcome> outcomes = task.evaluate_all(evaluations);
    if (outcomes.size() != evaluations.size()) return std::nullopt;
    for (Outcome& outcome : outcomes) outcome = checked(outcome, description);
    return outcomes;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (...) {
    return std::nullopt;
  }
}

}  // namespace treeroll::worker
