#include "workers/app/checked_evaluation.h"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <new>

#include "workers/tasks/trace.h"

namespace treeroll::worker {

CheckedEvaluation evaluate_checked(Task& task, const TaskDescription& description,
                                   Controller& controller, std::uint64_t seed, Trace* trace) {
  const auto failed = [](std::string complaint) -> CheckedEvaluation {
    return {{.reward = 0, .status = RolloutStatus::kFailed}, std::move(complaint)};
  };
  try {
    const Evaluation evaluation = trace == nullptr ? task.evaluate(controller, seed)
                                                   : task.evaluate_traced(controller, seed, *trace);
    if (evaluation.status != RolloutStatus::kOk) return {{0, evaluation.status}, ""};
    const bool in_range = std::isfinite(evaluation.reward) &&
                          evaluation.reward >= description.reward_min &&
                          evaluation.reward <= description.reward_max;
    if (in_range) return {evaluation, ""};
    return failed(fmt::format("the task's reward {} is outside its range {} .. {}",
                              evaluation.reward, description.reward_min, description.reward_max));
  } catch (const std::bad_alloc&) {
    throw;  // a want of this host, not of the roll-out: the process ends, and another tries
  } catch (const std::exception& error) {
    return failed(error.what());
  } catch (...) {
    return failed("the task threw what is no std::exception");
  }
}

}  // namespace treeroll::worker
