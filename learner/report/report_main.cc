#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <exception>

#include "common/base/config_error.h"
#include "learner/report/report.h"
#include "learner/study/study_error.h"
#include "learner/worker_program/process.h"

namespace treeroll::report {
namespace {

constexpr int kBadInput = 2;

int report_main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("report"));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");

  ReportOptions options;
  CLI::App app{"Says what studies have found: tables, statistics and figures in one HTML file."};
  app.set_version_flag("--version", TREEROLL_VERSION);
  app.add_option("DIR", options.directories,
                 "State directories of studies; two are compared, condition by condition")
      ->required();
  app.add_option("--claims", options.claims_file, "Claims (TOML) to put beside what was measured");
  app.add_option("--output", options.output, "Folder of report.html, report.md and report.json")
      ->capture_default_str();
  app.add_option(
         "--compare", options.compare,
         "Two conditions, each CONDITION or STUDY:CONDITION, the first claimed to be better")
      ->expected(2);
  options.worker_program = program_beside_us("treeroll-worker");
  const CLI::Option* worker_program =
      app.add_option("--worker-program", options.worker_program,
                     "Worker executable that knows the tasks: it makes the roll-outs shown")
          ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadInput;
  }
  options.needs_worker_program = worker_program->count() > 0;
  try {
    write_report(options);
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
}  // namespace treeroll::report

int main(int argc, char** argv) { return treeroll::report::report_main(argc, argv); }
