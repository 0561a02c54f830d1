#include <filesystem>
#include <string>

#include "common/base/config_error.h"
#include "common/program/program.h"
#include "common/protocol/limits.h"
#include "common/transport/bus.h"
#include "learner/app/check_study.h"
#include "learner/app/help_keys.h"
#include "learner/app/learn.h"
#include "learner/app/new_study.h"
#include "learner/app/preview_study.h"

namespace treeroll {
namespace {

constexpr int kPreviewsMax = 10'000;

void describe_learner(CommandLine& line, LearnerOptions& options) {
  const Option study = line.add("STUDY", options.study_file, "Study file (TOML)");
  const Option state_dir =
      line.add("--state-dir", options.state_dir,
               "Empty or new directory for what the study yields [treeroll-runs/NAME]");
  const Option resume = line.add("--resume", options.resume_dir,
                                 "State directory of a study that was interrupted: go on");
  line.add("--salvage", options.salvage,
           "With --resume: of a damaged journal keep the part before the damage")
      .needs(resume);
  line.add("--local-workers", options.local_workers,
           "Start a worker daemon with this many evaluators on this host; 0: none")
      .between(0, protocol::kEvaluatorsPerWorkerMax)
      .shows_default();
  line.add(kWorkerProgramOption, options.worker_program.path,
           "Worker executable that knows the task [treeroll-worker beside this one]");
  const Option evaluator =
      line.add(kEvaluatorOption, options.worker_program.evaluator, kEvaluatorHelp);
  line.add("--lcm-url", options.lcm_url,
           "LCM URL [LCM_DEFAULT_URL, else udpm://239.255.76.67:7667?ttl=0]");
  line.add("--key-file", options.key_file,
           "Learner's keys of treeroll-keygen: what is said is signed, what is not signed is "
           "refused; handed on to the local worker");
  line.add("--set", options.overrides,
           "KEY=VALUE overrides a key of the study, TOML value; with --resume it extends the "
           "study: more study.rollouts, study.repetitions or study.stop_after_s")
      .one_value_each_time();
  resume.excludes(study).excludes(state_dir);
  const Option http = line.add("--http", options.page.address,
                               "[ADDRESS:]PORT: show a page that follows the learning; 127.0.0.1 "
                               "unless ADDRESS is another, port 0: one that is free");
  line.add("--http-token-file", options.page.token_file,
           "With --http: file with the token that a browser must bring; needed on an address that "
           "other hosts reach")
      .needs(http);
  line.add("--json", options.json, "Print the summary as JSON on standard output");
  const Option check =
      line.add("--check", options.check,
               "Say what STUDY would do: runs, roll-outs, theta, the start's reward, "
               "the time, what is set by default; each start policy is evaluated once, but for "
               "tasks that are not repeatable")
          .needs(study)
          .excludes(resume);
  line.add("--preview", options.preview,
           "Print as CSV what so many perturbed policies of each condition give, as they are drawn "
           "before the first update of each run; start nothing")
      .between(1, kPreviewsMax)
      .needs(study)
      .excludes(resume)
      .excludes(check);
  const Option new_file = line.add("--new", options.new_file,
                                   "Write a commented study of --task to this file, to begin with");
  const Option new_task = line.add("--task", options.new_task,
                                   "With --new: a task that the worker program knows; --set "
                                   "task.KEY=VALUE sets what it requires");
  new_file.needs(new_task).excludes(study).excludes(resume);
  new_task.needs(new_file);
  const Option help_keys = line.add(
      "--help-keys", options.help_keys,
      "Print every key that a study may have with its type, default, bounds and meaning, all "
      "or those that hold the text, and end; a program of your own lists none of its settings: "
      "--check says what it takes by default");
  help_keys.excludes(evaluator);
  line.require_any("STUDY, --resume DIR, --new FILE or --help-keys",
                   {study, resume, new_file, help_keys});
  line.end_help_with(
      "Exit status: 0 done; 2 bad input, nothing was started; 3 stopped early, --resume goes on; 4 "
      "done, but no roll-out had a positive reward; 1 anything else.");
}

int learn(LearnerOptions options) {
  WorkerProgram& worker = options.worker_program;
  options.needs_worker_program =
      options.local_workers > 0 || !worker.path.empty() || !worker.evaluator.empty();
  check_and_complete(worker);
  if (options.help_keys) {
    print_keys(*options.help_keys, worker);
    return kExitDone;
  }
  if (!options.new_file.empty()) {
    write_new_study(options);
    return kExitDone;
  }
  if (options.resume_dir.empty() && !std::filesystem::exists(options.study_file)) {
    throw ConfigError("STUDY", options.study_file.string(),
                      "no such file; treeroll-learner --new FILE --task NAME writes one");
  }
  if (options.check) {
    check_study(options);
    return kExitDone;
  }
  if (options.preview > 0) {
    preview_study(options);
    return kExitDone;
  }
  options.lcm_url = transport::daemon_url("--lcm-url", options.lcm_url);
  return run_learner(options);
}

int learner_main(int argc, char** argv) {
  LearnerOptions options;
  return run_main(argc, argv,
                  {.name = "treeroll-learner",
                   .purpose = "Learns the runs of a study with every worker on the LCM bus.",
                   .log_name = "learner",
                   .examples = {{"treeroll-learner --new my_study.toml --task swing_up",
                                 "write a study to begin with"},
                                {"treeroll-learner my_study.toml --check", "say what it would do"},
                                {"treeroll-learner my_study.toml --local-workers 4 --http 8080",
                                 "learn it on this host and show it on a page"},
                                {"treeroll-learner --resume treeroll-runs/my_study",
                                 "go on where it was stopped"}},
                   .options = [&](CommandLine& line) { describe_learner(line, options); },
                   .work = [&] { return learn(options); }});
}

}  // namespace
}  // namespace treeroll

int main(int argc, char** argv) { return treeroll::learner_main(argc, argv); }
