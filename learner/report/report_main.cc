#include "common/program/program.h"
#include "learner/report/report.h"

namespace treeroll::report {
namespace {

void describe(CommandLine& line, ReportOptions& options) {
  line.add("DIR", options.directories,
           "State directories of studies; two are compared, condition by condition")
      .required();
  line.add("--claims", options.claims_file, "Claims (TOML) to put beside what was measured");
  line.add("--output", options.output, "Folder of report.html, report.md and report.json")
      .shows_default();
  line.add("--compare", options.compare,
           "Two conditions, each CONDITION or STUDY:CONDITION, the first claimed to be better")
      .takes(2);
  line.add(kWorkerProgramOption, options.worker_program.path,
           "Worker executable that knows the tasks: it makes the roll-outs shown "
           "[treeroll-worker beside this one]");
  line.add(kEvaluatorOption, options.worker_program.evaluator, kEvaluatorHelp);
}

int report(ReportOptions options) {
  WorkerProgram& worker = options.worker_program;
  options.needs_worker_program = !worker.path.empty() || !worker.evaluator.empty();
  check_and_complete(worker);
  write_report(options);
  return kExitDone;
}

int report_main(int argc, char** argv) {
  ReportOptions options;
  return run_main(
      argc, argv,
      {.name = "treeroll-report",
       .purpose = "Says what studies have found: tables, statistics and figures in one HTML file.",
       .examples = {{"treeroll-report treeroll-runs/swing_up", "writes report/report.html"},
                    {"treeroll-report runs/a runs/b --claims my_claims.toml",
                     "two studies, and claims held against them"}},
       .options = [&](CommandLine& line) { describe(line, options); },
       .work = [&] { return report(options); }});
}

}  // namespace
}  // namespace treeroll::report

int main(int argc, char** argv) { return treeroll::report::report_main(argc, argv); }
