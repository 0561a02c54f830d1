#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <limits>

#include "common/base/config_error.h"
#include "learner/app/evaluate.h"
#include "learner/study/study_error.h"
#include "learner/worker_program/process.h"

namespace treeroll {
namespace {

constexpr int kBadInput = 2;

int evaluate_main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("evaluate"));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");

  EvaluateOptions options;
  options.worker_program = program_beside_us("treeroll-worker");
  CLI::App app{"Says what a policy is worth on the task of a study, and what it does."};
  app.set_version_flag("--version", TREEROLL_VERSION);
  app.add_option("POLICY", options.policy_file, "Policy file (JSON), policies/*.json of a study")
      ->required();
  app.add_option("STUDY", options.study_file, "Study file (TOML) that names the task")->required();
  app.add_option("--condition", options.condition,
                 "Condition of the study whose task counts, where they differ");
  app.add_option("--set", options.overrides, "KEY=VALUE overrides a key of the study, TOML value")
      ->type_size(1)
      ->allow_extra_args(false);
  app.add_option("--worker-program", options.worker_program,
                 "Worker executable that knows the task")
      ->capture_default_str();
  app.add_option("--seed", options.seed, "For tasks that are not deterministic")
      ->check(CLI::Range(std::int64_t{0}, std::numeric_limits<std::int64_t>::max()))
      ->capture_default_str();
  app.add_option("--trace", options.trace_file,
                 "Write states, inputs and cost over time to this file (CSV)");
  app.add_flag("--json", options.json, "Print the outcome as JSON");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadInput;
  }
  try {
    evaluate_policy(options);
    return 0;
  } catch (const StudyError& error) {
    spdlog::error("{}", error.what());
    return kBadInput;
  } catch (const ConfigError& error) {
    spdlog::error("{}", error.what());
    return kBadInput;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return 1;
  }
}

}  // namespace
}  // namespace treeroll

int main(int argc, char** argv) { return treeroll::evaluate_main(argc, argv); }
