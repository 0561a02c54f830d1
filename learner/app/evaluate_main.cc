#include <cstdint>
#include <limits>

#include "common/program/program.h"
#include "learner/app/evaluate.h"
#include "learner/worker_program/process.h"

namespace treeroll {
namespace {

constexpr int kEvaluationsMax = 10'000;

void describe_evaluate(CommandLine& line, EvaluateOptions& options) {
  line.add("POLICY", options.policy_file,
           "Policy file (JSON); of a study's run: policies/CONDITION-REPETITION.json, the "
           "best roll-out, and policies/CONDITION-REPETITION.final.json, the final mean policy")
      .required();
  line.add("STUDY", options.study_file, "Study file (TOML) that names the task").required();
  line.add("--condition", options.condition,
           "Condition of the study whose task and bounds count, where they differ");
  line.add("--set", options.overrides, "KEY=VALUE overrides a key of the study, TOML value")
      .one_value_each_time();
  line.add(kWorkerProgramOption, options.worker_program.path,
           "Worker executable that knows the task")
      .shows_default();
  line.add(kEvaluatorOption, options.worker_program.evaluator, kEvaluatorHelp);
  line.add("--seed", options.seed, "For tasks that are not deterministic")
      .between(0, std::numeric_limits<std::int64_t>::max())
      .shows_default();
  line.add("--evaluations", options.evaluations,
           "Evaluate it so often, with the seeds from --seed on: mean and 95 % interval")
      .between(1, kEvaluationsMax)
      .shows_default();
  line.add("--trace", options.trace_file,
           "Write states, inputs and cost over time to this file (CSV)");
  line.add("--json", options.json, "Print the outcome as JSON");
}

int evaluate_main(int argc, char** argv) {
  EvaluateOptions options;
  options.worker_program.path = program_beside_us("treeroll-worker");
  return run_main(
      argc, argv,
      {.name = "treeroll-evaluate",
       .purpose = "Says what a policy is worth on the task of a study, and what it does.",
       .examples = {{"treeroll-evaluate policies/tree-0.json study.toml --evaluations 20",
                     "the mean reward of a learnt policy, in its state directory"},
                    {"treeroll-evaluate best.json study.toml --trace trace.csv",
                     "what it does, step by step"}},
       .options = [&](CommandLine& line) { describe_evaluate(line, options); },
       .work =
           [&] {
             check_and_complete(options.worker_program);
             evaluate_policy(options);
             return kExitDone;
           }});
}

}  // namespace
}  // namespace treeroll

int main(int argc, char** argv) { return treeroll::evaluate_main(argc, argv); }
