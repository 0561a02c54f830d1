#include "workers/app/worker_main.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "common/base/config_error.h"
#include "common/base/content_hash.h"
#include "common/base/cut_text.h"
#include "common/base/for_log.h"
#include "common/program/host_name.h"
#include "common/program/process_start.h"
#include "common/program/processor_share.h"
#include "common/program/program.h"
#include "common/program/program_command.h"
#include "common/program/random_id.h"
#include "common/protocol/limits.h"
#include "common/transport/bus.h"
#include "workers/app/evaluate_policy.h"
#include "workers/app/evaluator.h"
#include "workers/app/floating_point.h"
#include "workers/app/help_tasks.h"
#include "workers/app/host_facts.h"
#include "workers/app/process_limits.h"
#include "workers/app/program_log.h"
#include "workers/app/task_content.h"
#include "workers/app/worker_daemon.h"
#include "workers/user_program/user_program.h"

namespace treeroll::worker {
namespace {

constexpr int kIdleSecondsMax = 10'000'000;

struct Options {
  std::string processes;
  std::string lcm_url;
  std::filesystem::path key_file;
  int exit_when_idle_s = 0;
  bool describe_task = false;
  bool evaluate = false;
  std::optional<std::string> help_tasks;
  std::string task_example;
  std::string evaluator;
  std::string numeric_class;
  int memory_limit_mb = 0;
  int evaluator_socket = -1;
  int parent_pid = 0;
};

constexpr const char* kEvaluatorOption = "--evaluator";
constexpr int kMemoryLimitMbMax = 100'000'000;

int read_processes(const std::string& text) {
  if (text.empty()) {
    return std::min(num_usable_processors(), protocol::kEvaluatorsPerWorkerMax);
  }
  int number = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || rest != end || number < 1 ||
      number > protocol::kEvaluatorsPerWorkerMax) {
    throw ConfigError(
        "--processes", text,
        "must be an integer from 1 to " + std::to_string(protocol::kEvaluatorsPerWorkerMax));
  }
  return number;
}

/// What a user's program computes is as good as its command says: whoever runs another one, or in
/// another environment that its command names, is not compared with it. Our own tasks say what else
/// their bits depend on.
std::string class_of(const Options& options, const TaskRegistry& registry) {
  if (!options.numeric_class.empty()) {
    if (options.numeric_class.size() > protocol::kNumericClassBytesMax ||
        for_log(options.numeric_class) != options.numeric_class) {
      throw ConfigError("--numeric-class", for_log(options.numeric_class),
                        "must be one line of text of at most " +
                            std::to_string(protocol::kNumericClassBytesMax) + " bytes");
    }
    return options.numeric_class;
  }
  if (options.evaluator.empty()) {
    const StandardFloatingPoint as_in_an_evaluator;
    return cut_text(numeric_class() + registry.numeric_suffix(), protocol::kNumericClassBytesMax);
  }
  constexpr std::size_t kShownDigits = 12;
  return numeric_class() + " program " +
         to_hex(content_hash(options.evaluator)).substr(0, kShownDigits);
}

/// A program of the user's may take long to start: an interpreter, a simulator, its models.
constexpr std::chrono::seconds kProgramLoadTimeLimit(60);

int serve(const Options& options, const TaskRegistry& registry) {
  end_when_stopped(kExitDone, "asked to end while it was starting\n");
  WorkerSettings settings;
  settings.num_evaluators = read_processes(options.processes);
  settings.worker_id = random_id();
  settings.host = host_name();
  settings.pid = getpid();
  settings.version = program_version();
  settings.numeric_class = class_of(options, registry);
  if (options.exit_when_idle_s > 0) {
    settings.idle_max = std::chrono::seconds(options.exit_when_idle_s);
  }
  if (!options.evaluator.empty()) {
    read_program_command(kEvaluatorOption, options.evaluator);
    settings.load_time_limit = kProgramLoadTimeLimit;
    settings.one_task_at_a_time = true;
    settings.end_grace = kEvaluatorEndGrace;
  }
  const std::string url = transport::daemon_url("--lcm-url", options.lcm_url);
  auto keys = transport::key_file_of("--key-file", options.key_file, transport::Voice::kWorker);
  if (keys) settings.worker_id = keys->keys().worker_id(settings.worker_id);
  const std::string trust = transport::trust_in_words(keys);
  auto daemon =
      WorkerDaemon::open(url, std::move(keys), settings,
                         {options.evaluator, options.memory_limit_mb, settings.num_evaluators});
  if (!daemon) {
    spdlog::error("{}", daemon.error().message);
    return kExitOther;
  }
  spdlog::info("worker {} with {} evaluators on {}", settings.worker_id, settings.num_evaluators,
               url);
  spdlog::info("{}", trust);
  const int status = (*daemon)->run();
  spdlog::info("ends with status {}", status);
  return status;
}

void describe(CommandLine& line, Options& options) {
  line.add("--processes", options.processes,
           "Evaluator processes; default: one for each processor it may use");
  line.add("--lcm-url", options.lcm_url,
           "Where the learners are; default: LCM_DEFAULT_URL, else LCM's own, this host");
  line.add("--key-file", options.key_file,
           "Keys of treeroll-keygen: what is said is signed, what is not signed is refused; a "
           "worker's or a learner's");
  line.add("--exit-when-idle", options.exit_when_idle_s,
           "Drain and end after so many seconds without a roll-out; default: never")
      .between(1, kIdleSecondsMax);
  line.add("--describe-task", options.describe_task,
           "Read {\"name\": ..., \"settings\": {...}} from standard input, print what the task "
           "says of itself or what is wrong, and end");
  line.add("--evaluate", options.evaluate,
           "Read {\"task\": {...}, \"policy\": TEXT, \"seed\": 0, \"trace\": false} from standard "
           "input, print the policy's reward, and end; treeroll-evaluate is more convenient");
  const Option evaluator = line.add(
      kEvaluatorOption, options.evaluator,
      "Command of a program of your own, in any language, that evaluates instead of the tasks "
      "of this one; treeroll-check-evaluator checks it");
  line.add("--numeric-class", options.numeric_class,
           "Workers of one class must give the same bits; default: of processor, C library and the "
           "command of --evaluator");
  line.add("--memory-limit-mb", options.memory_limit_mb,
           "Data that an evaluator may hold; 0: no limit")
      .between(0, kMemoryLimitMbMax)
      .shows_default();
  line.add("--evaluator-socket", options.evaluator_socket, "").hidden();
  line.add("--parent", options.parent_pid, "").hidden();
  line.add("--task-example", options.task_example, "").hidden();
  const Option help_tasks =
      line.add("--help-tasks", options.help_tasks,
               "Print the settings of its tasks, all or those that hold the text, and end; a "
               "program of your own lists none: treeroll-learner STUDY --check says what it takes "
               "by default");
  help_tasks.excludes(evaluator);
}

std::unique_ptr<TaskSource> source_of(const Options& options, const TaskRegistry& registry) {
  if (options.evaluator.empty()) return tasks_of(registry);
  const ProgramSettings program{.command = options.evaluator,
                                .words = read_program_command(kEvaluatorOption, options.evaluator)};
  const ProgramLog log(options.processes.empty() ? 1 : read_processes(options.processes));
  try {
    return tasks_of(std::make_unique<UserProgram>(program, log));
  } catch (const BadInput& error) {
    throw ConfigError(kEvaluatorOption, options.evaluator, error.what());
  }
}

int serve_daemon(const Options& options, const TaskRegistry& registry) {
  if (!become_evaluator(options.parent_pid)) return kExitOther;
  // What a task starts is not to speak to the daemon in our name.
  fcntl(options.evaluator_socket, F_SETFD, FD_CLOEXEC);
  try {
    return run_evaluator(*source_of(options, registry), options.evaluator_socket);
  } catch (const ProgramEnded& ended) {
    spdlog::warn("{}", ended.what);
    end_likewise(ended.end.exited, ended.end.code);
  }
}

int work(const Options& options, const TaskRegistry& registry) {
  if (options.help_tasks) {
    print_tasks(registry, *options.help_tasks);
    return kExitDone;
  }
  if (!options.task_example.empty()) return print_task_example(registry, options.task_example);
  const bool serves = options.evaluator_socket < 0 && !options.evaluate && !options.describe_task;
  if (serves) return serve(options, registry);
  constexpr std::uint64_t kBytesPerMb = 1'000'000;
  if (options.memory_limit_mb > 0) {
    limit_memory(kBytesPerMb * static_cast<std::uint64_t>(options.memory_limit_mb));
  }
  if (options.evaluator_socket >= 0) return serve_daemon(options, registry);
  const auto start = [&] { return source_of(options, registry); };
  return options.evaluate ? evaluate_policy(start) : describe_task(start);
}

}  // namespace
}  // namespace treeroll::worker

namespace treeroll {

int worker_main(int argc, char** argv, const TaskRegistry& registry) {
  worker::Options options;
  return run_main(
      argc, argv,
      {.name = "treeroll-worker",
       .purpose = "Evaluates roll-outs for the learners on an LCM network.",
       .log_name = "worker",
       .examples = {{"treeroll-worker --processes 4", "simulate for the learners of this host"},
                    {"treeroll-worker --lcm-url 'udpm://239.255.76.67:7667?ttl=1'",
                     "for those of the local network"},
                    {"treeroll-worker --evaluator 'python3 my_task.py'",
                     "with a program of your own"}},
       .options = [&](CommandLine& line) { worker::describe(line, options); },
       .work = [&] { return worker::work(options, registry); }});
}

}  // namespace treeroll
