#include "workers/app/checked_evaluation.h"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <new>

#include "workers/app/floating_point.h"
#include "workers/tasks/trace.h"

namespace treeroll::worker {

CheckedEvaluation evaluate_checked(Task& task, const TaskDescription& description,
                                   Controller& controller, std::uint64_t seed, Trace* trace) {
  const auto failed = [](std::string complaint) -> CheckedEvaluation {
    return {Outcome::failed(RolloutStatus::kFailed), std::move(complaint)};
  };
  const StandardFloatingPoint standard;
  try {
    const Outcome outcome = trace == nullptr ? task.evaluate(controller, seed)
                                             : task.evaluate_traced(controller, seed, *trace);
    if (!outcome.is_ok()) return {outcome, ""};
    const bool in_range = std::isfinite(outcome.reward()) &&
                          outcome.reward() >= description.reward_min &&
                          outcome.reward() <= description.reward_max;
    if (in_range) return {outcome, ""};
    return failed(fmt::format("the task's reward {} is outside its range {} .. {}",
                              outcome.reward(), description.reward_min, description.reward_max));
  } catch (const std::bad_alloc&) {
    throw;  // a want of this host, not of the roll-out: the process ends, and another tries
  } catch (const std::exception& error) {
    return failed(error.what());
  } catch (...) {
    return failed("the task threw what is no std::exception");
  }
}

}  // namespace treeroll::worker
