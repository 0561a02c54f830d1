#include "common/program/program.h"
#include "learner/app/replay.h"

namespace treeroll {
namespace {

constexpr int kExitDiffers = 1;

/// A journal is asked one thing at a time.
void exclude_each_other(const std::vector<Option>& questions) {
  for (auto one = questions.begin(); one != questions.end(); ++one) {
    for (auto earlier = questions.begin(); earlier != one; ++earlier) one->excludes(*earlier);
  }
}

void describe_replay(CommandLine& line, ReplayOptions& options) {
  line.add("PATH", options.path, "State directory, or a journal beside its study.toml").required();
  const Option verify =
      line.add("--verify", options.verify,
               "Recompute every perturbation and update, and compare the result files");
  line.add("--refit", options.refit,
           "With --verify: fit the start policies again and compare them with the study's")
      .needs(verify);
  const Option format =
      line.add("--export", options.export_format,
               "csv, jsonl: print a row a roll-out: reward, theta, mean and noise it was drawn "
               "from, worker (in jsonl ids are text: they have 63 bits); lcm: a log of LCM "
               "messages, for lcm-logplayer and lcm-spy")
          .one_of({"csv", "jsonl", "lcm"});
  const Option rollout =
      line.add("--policy", options.rollout,
               "RUN:ROLLOUT: print the policy of this roll-out; -1: the final one");
  const Option start =
      line.add("--start", options.start, "CONDITION: print the policy that it begins with");
  const Option shown =
      line.add("--show", options.shown,
               "RUN:ROLLOUT: print a roll-out with its policy, noise and trace as JSON");
  const Option http =
      line.add("--http", options.page.address,
               "[ADDRESS:]PORT: show a page of the journal, also while it grows, until Ctrl-C; "
               "127.0.0.1 unless ADDRESS is another, port 0: one that is free");
  line.add("--http-token-file", options.page.token_file,
           "With --http: file with the token that a browser must bring; needed on an address that "
           "other hosts reach")
      .needs(http);
  line.add(kWorkerProgramOption, options.worker_program.path,
           "For --show and --http: worker executable that knows the task [treeroll-worker beside "
           "this one]")
      .excludes(verify)
      .excludes(format);
  line.add(kEvaluatorOption, options.worker_program.evaluator, kEvaluatorHelp)
      .excludes(verify)
      .excludes(format);
  const Option results =
      line.add("--results", options.results_dir,
               "New directory for the result files of what has been learnt so far");
  const Option without =
      line.add("--without-worker", options.without_workers,
               "Fold the study again without the results of this worker (repeatable), or of all "
               "\"suspects\", those that others have outvoted (study.recheck)")
          .one_value_each_time();
  const Option state_dir =
      line.add("--state-dir", options.new_state_dir,
               "With --without-worker: new directory for the study without them; a learner goes on "
               "there (--resume)")
          .needs(without);
  without.needs(state_dir);
  exclude_each_other({verify, format, rollout, start, shown, http, results, without});
  line.add("--output", options.output_file, "File of what is asked for, not standard output")
      .excludes(verify)
      .excludes(results)
      .excludes(without)
      .excludes(http);
}

int work(ReplayOptions& options) {
  check_and_complete(options.worker_program);
  return replay(options) ? kExitDone : kExitDiffers;
}

int replay_main(int argc, char** argv) {
  ReplayOptions options;
  return run_main(
      argc, argv,
      {.name = "treeroll-replay",
       .purpose =
           "Reads a learner's journal, also while it is written: what is in it, and whether every "
           "step follows from it.",
       .examples = {{"treeroll-replay treeroll-runs/swing_up", "what the journal holds"},
                    {"treeroll-replay treeroll-runs/swing_up --verify",
                     "make every draw and update again and compare"},
                    {"treeroll-replay treeroll-runs/swing_up --http 8080", "its page"},
                    {"treeroll-replay treeroll-runs/swing_up --export lcm --output played.lcmlog",
                     "as messages, for lcm-logplayer"},
                    {"treeroll-replay treeroll-runs/swing_up --without-worker suspects --state-dir "
                     "treeroll-runs/sound",
                     "the study without the results of workers that others contradict"}},
       .options = [&](CommandLine& line) { describe_replay(line, options); },
       .work = [&] { return work(options); }});
}

}  // namespace
}  // namespace treeroll

int main(int argc, char** argv) { return treeroll::replay_main(argc, argv); }
