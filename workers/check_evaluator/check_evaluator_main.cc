#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "common/base/config_error.h"
#include "common/base/json_text.h"
#include "common/files/whole_file.h"
#include "common/program/program.h"
#include "common/program/program_command.h"
#include "common/program/standard_output.h"
#include "workers/check_evaluator/conformance.h"

namespace treeroll::worker {
namespace {

constexpr int kAnswerLimitSMax = 100'000;
constexpr int kSettingsNestingMax = 32;

struct Options {
  std::string command;
  std::string name = "task";
  std::string settings = "{}";
  std::filesystem::path policy_file;
  bool moves = false;
  int answer_limit_s = 60;
};

void describe(CommandLine& line, Options& options) {
  line.add("CMD", options.command, "The program and its arguments: 'python3 my_task.py'")
      .required();
  line.add("--name", options.name, "Of the task, as a study's [task] has it").shows_default();
  line.add("--settings", options.settings, "JSON object, the study's [task] without its name")
      .shows_default();
  line.add("--policy", options.policy_file,
           "Policy file (JSON) to evaluate [samples of the task's dimensions]");
  line.add("--move", options.moves,
           "With --policy: evaluate it seven times or more also where the task is not repeatable, "
           "so that a robot moves");
  line.add("--answer-limit-s", options.answer_limit_s,
           "No description may take longer than this; an evaluation may take twice the task's "
           "time_limit_s and a second")
      .between(1, kAnswerLimitSMax)
      .shows_default();
  line.end_help_with(
      "The rules are those of EVALUATOR.md. Exit status: 0 all that must be kept is kept; 1 a rule "
      "is broken, or no policy got a reward; 2 bad input.");
}

const char* word(Finding::Verdict verdict) {
  switch (verdict) {
    case Finding::Verdict::kKept:
      return "ok";
    case Finding::Verdict::kBroken:
      return "BROKEN";
    case Finding::Verdict::kAdvised:
      return "advised";
    case Finding::Verdict::kNotTried:
      return "not tried";
    case Finding::Verdict::kUndecided:
      return "unknown";
  }
  return "";
}

int check(const Options& options) {
  const Result<nlohmann::json> settings = parse_json(options.settings, kSettingsNestingMax);
  if (!settings || !settings->is_object()) {
    throw ConfigError("--settings", options.settings, "must be a JSON object");
  }
  ConformanceRun run{.program = {options.command, read_program_command("CMD", options.command)},
                     .task = options.name,
                     .settings = options.settings,
                     .policy = {},
                     .moves = options.moves,
                     .answer_limit = std::chrono::seconds(options.answer_limit_s),
                     .log = [](const std::string& where, const std::string& line) {
                       spdlog::info("{}: {}", where, line);
                     }};
  if (!options.policy_file.empty()) {
    try {
      run.policy = read_whole_file(options.policy_file);
    } catch (const std::runtime_error& error) {
      throw ConfigError("--policy", options.policy_file.string(), error.what());
    }
  }
  std::set<Finding::Verdict> found;
  for (const Finding& finding : check_evaluator(run)) {
    fmt::print("{:9}  rule {:2}  {}\n", word(finding.verdict), finding.rule, finding.what);
    found.insert(finding.verdict);
  }
  const bool is_broken = found.contains(Finding::Verdict::kBroken);
  const bool is_undecided = found.contains(Finding::Verdict::kUndecided);
  const bool is_whole = !found.contains(Finding::Verdict::kNotTried);
  fmt::print("{}\n", is_broken ? "the program cannot be used as an evaluator yet"
                     : is_undecided
                         ? "no policy got a reward: whether the program can be used is unknown"
                     : is_whole ? "the program can be used as an evaluator"
                                : "what was tried of the program is right");
  flush_standard_output();
  return is_broken || is_undecided ? kExitOther : kExitDone;
}

int check_evaluator_main(int argc, char** argv) {
  Options options;
  return run_main(argc, argv,
                  {.name = "treeroll-check-evaluator",
                   .purpose = "Checks a program of your own as an evaluator: treeroll-worker "
                              "--evaluator CMD.",
                   .examples = {{"treeroll-check-evaluator 'python3 my_task.py' --name reach",
                                 "does it keep the rules of EVALUATOR.md?"}},
                   .options = [&](CommandLine& line) { describe(line, options); },
                   .work = [&] { return check(options); }});
}

}  // namespace
}  // namespace treeroll::worker

int main(int argc, char** argv) { return treeroll::worker::check_evaluator_main(argc, argv); }
