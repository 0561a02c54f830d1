#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <exception>

#include "common/base/config_error.h"
#include "common/protocol/limits.h"
#include "common/transport/bus.h"
#include "learner/app/daemon.h"
#include "learner/study/study_file.h"
#include "learner/worker_program/process.h"

namespace treeroll {
namespace {

int learner_main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("learner"));
  spdlog::set_pattern("%Y-%m-%d %H:%M:%S.%e learner[%P] %^%l%$: %v");

  LearnerOptions options;
  std::string lcm_url;
  CLI::App app{"Learns the runs of a study with every worker on the LCM bus."};
  app.set_version_flag("--version", TREEROLL_VERSION);
  CLI::Option* study = app.add_option("STUDY", options.study_file, "Study file (TOML)");
  CLI::Option* state_dir =
      app.add_option("--state-dir", options.state_dir,
                     "Empty or new directory for what the study yields [treeroll-runs/NAME]");
  CLI::Option* resume = app.add_option("--resume", options.resume_dir,
                                       "State directory of a study that was interrupted: go on");
  app.add_flag("--salvage", options.salvage,
               "With --resume: of a damaged journal keep the part before the damage")
      ->needs(resume);
  app.add_option("--local-workers", options.local_workers,
                 "Start a worker daemon with this many evaluators on this host; 0: none")
      ->check(CLI::Range(0, protocol::kEvaluatorsPerWorkerMax))
      ->capture_default_str();
  app.add_option("--worker-program", options.worker_program,
                 "Worker executable that knows the task [treeroll-worker beside this one]");
  app.add_option("--lcm-url", lcm_url,
                 "LCM URL [LCM_DEFAULT_URL, else udpm://239.255.76.67:7667?ttl=0]");
  CLI::Option* set = app.add_option("--set", options.overrides,
                                    "KEY=VALUE overrides a key of the study, TOML value")
                         ->type_size(1)
                         ->allow_extra_args(false);
  resume->excludes(study)->excludes(state_dir)->excludes(set);
  app.add_flag("--json", options.json, "Print the summary as JSON on standard output");
  try {
    app.parse(argc, argv);
    if (study->empty() && resume->empty()) throw CLI::RequiredError("STUDY or --resume DIR");
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitDone : kExitBadInput;
  }
  options.lcm_url = transport::resolve_url(lcm_url);
  options.needs_worker_program = options.local_workers > 0 || !options.worker_program.empty();
  if (options.worker_program.empty()) {
    options.worker_program = program_beside_us("treeroll-worker");
  }

  try {
    return run_learner(options);
  } catch (const StudyError& error) {
    spdlog::error("{}", error.what());
    return kExitBadInput;
  } catch (const ConfigError& error) {
    spdlog::error("{}", error.what());
    return kExitBadInput;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return kExitOther;
  }
}

}  // namespace
}  // namespace treeroll

int main(int argc, char** argv) { return treeroll::learner_main(argc, argv); }
