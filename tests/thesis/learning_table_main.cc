// What deploy/learning-table runs: a study in one process, and how soon each condition has learnt.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "tests/thesis/learning_table.h"
#include "tests/thesis/run_study.h"

int main(int argc, char** argv) {
  CLI::App app{"Learns a study in one process and prints how soon each condition came to a reward"};
  std::string study;
  std::vector<std::string> overrides;
  int seeds = 30;
  double target = .99;
  std::vector<int> budgets = {300, 1000};
  app.add_option("study", study, "Study file")->required();
  app.add_option("--set", overrides, "KEY=VALUE, as of treeroll-learner")->allow_extra_args(false);
  app.add_option("--seeds", seeds, "Runs of each condition")->check(CLI::Range(1, 100000));
  app.add_option("--target", target, "Reward that counts as learnt");
  app.add_option("--budgets", budgets, "Roll-outs within which it is counted");
  CLI11_PARSE(app, argc, argv);
  try {
    overrides.push_back(fmt::format("study.repetitions={}", seeds));
    const auto runs = treeroll::run_study(study, overrides);
    const auto rows = treeroll::learning_rows(runs, target);
    std::fputs(treeroll::learning_table(rows, budgets).c_str(), stdout);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "learning_table: %s\n", error.what());
    return 2;
  }
}
