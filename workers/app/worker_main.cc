#include "workers/app/worker_main.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>

#include "common/base/config_error.h"
#include "common/program/host_name.h"
#include "common/program/process_start.h"
#include "common/program/program.h"
#include "common/program/random_id.h"
#include "common/protocol/limits.h"
#include "common/transport/bus.h"
#include "workers/app/evaluate_policy.h"
#include "workers/app/evaluator.h"
#include "workers/app/host_facts.h"
#include "workers/app/processor_share.h"
#include "workers/app/task_content.h"
#include "workers/app/worker_daemon.h"

namespace treeroll::worker {
namespace {

constexpr int kIdleSecondsMax = 10'000'000;

struct Options {
  std::string processes;
  std::string lcm_url;
  int exit_when_idle_s = 0;
  bool describe_task = false;
  bool evaluate = false;
  int evaluator_socket = -1;
  int parent_pid = 0;
};

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

int serve(const Options& options) {
  end_when_stopped(kExitDone, "asked to end while it was starting\n");
  WorkerSettings settings;
  settings.num_evaluators = read_processes(options.processes);
  settings.worker_id = random_id();
  settings.host = host_name();
  settings.pid = getpid();
  settings.version = program_version();
  settings.numeric_class = numeric_class();
  if (options.exit_when_idle_s > 0) {
    settings.idle_max = std::chrono::seconds(options.exit_when_idle_s);
  }
  const std::string url = transport::resolve_url(options.lcm_url);
  auto daemon = WorkerDaemon::open(url, settings);
  if (!daemon) {
    spdlog::error("{}", daemon.error().message);
    return kExitBadInput;
  }
  spdlog::info("worker {} with {} evaluators on {}", settings.worker_id, settings.num_evaluators,
               url);
  const int status = (*daemon)->run();
  spdlog::info("ends with status {}", status);
  return status;
}

void describe(CommandLine& line, Options& options) {
  line.add("--processes", options.processes,
           "Evaluator processes; default: one for each processor it may use");
  line.add("--lcm-url", options.lcm_url,
           "Where the learners are; default: LCM_DEFAULT_URL, else LCM's own, this host");
  line.add("--exit-when-idle", options.exit_when_idle_s,
           "Drain and end after so many seconds without a roll-out; default: never")
      .between(1, kIdleSecondsMax);
  line.add("--describe-task", options.describe_task,
           "Read {\"name\": ..., \"settings\": {...}} from standard input, print what the task "
           "says of itself or what is wrong, and end");
  line.add("--evaluate", options.evaluate,
           "Read {\"task\": {...}, \"policy\": TEXT, \"seed\": 0, \"trace\": false} from standard "
           "input, print the policy's reward, and end; treeroll-evaluate is more convenient");
  line.add("--evaluator", options.evaluator_socket, "").hidden();
  line.add("--parent", options.parent_pid, "").hidden();
}

int work(const Options& options, const TaskRegistry& registry) {
  if (options.evaluator_socket >= 0) {
    return run_evaluator(registry, options.evaluator_socket, options.parent_pid);
  }
  if (options.evaluate) return evaluate_policy(registry);
  if (options.describe_task) return describe_task(registry);
  return serve(options);
}

}  // namespace
}  // namespace treeroll::worker

namespace treeroll {

int worker_main(int argc, char** argv, const TaskRegistry& registry) {
  worker::Options options;
  return run_main(argc, argv,
                  {.name = "treeroll-worker",
                   .purpose = "Evaluates roll-outs for the learners on an LCM network.",
                   .log_name = "worker",
                   .options = [&](CommandLine& line) { worker::describe(line, options); },
                   .work = [&] { return worker::work(options, registry); }});
}

}  // namespace treeroll
