#include "workers/app/worker_main.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <iostream>
#include <thread>

#include "common/base/config_error.h"
#include "common/protocol/limits.h"
#include "common/transport/bus.h"
#include "workers/app/evaluate_policy.h"
#include "workers/app/evaluator.h"
#include "workers/app/host_facts.h"
#include "workers/app/task_content.h"
#include "workers/app/worker_daemon.h"

namespace treeroll::worker {
namespace {

struct Options {
  std::string processes;
  std::string lcm_url;
  bool describe_task = false;
  bool evaluate = false;
  int evaluator_socket = -1;
  int parent_pid = 0;
};

int read_processes(const std::string& text) {
  if (text.empty()) {
    return std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1,
                      protocol::kEvaluatorsPerWorkerMax);
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

void log_to_standard_error() {
  auto logger = spdlog::stderr_logger_st("treeroll-worker");
  logger->set_pattern("%Y-%m-%d %H:%M:%S.%e worker[%P] %l: %v");
  spdlog::set_default_logger(std::move(logger));
}

int serve(const Options& options) {
  WorkerSettings settings;
  settings.num_evaluators = read_processes(options.processes);
  settings.worker_id = random_id();
  settings.host = host_name();
  settings.pid = getpid();
  settings.version = TREEROLL_VERSION;
  settings.numeric_class = numeric_class();
  const std::string url = transport::resolve_url(options.lcm_url);
  auto daemon = WorkerDaemon::open(url, settings);
  if (!daemon) {
    spdlog::error("{}", daemon.error().message);
    return 2;
  }
  spdlog::info("worker {:x} with {} evaluators on {}", settings.worker_id, settings.num_evaluators,
               url);
  const int status = (*daemon)->run();
  spdlog::info("ends with status {}", status);
  return status;
}

}  // namespace
}  // namespace treeroll::worker

namespace treeroll {

int worker_main(int argc, char** argv, const TaskRegistry& registry) {
  worker::log_to_standard_error();
  worker::Options options;
  CLI::App app("Evaluates roll-outs for the learners on an LCM network.", "treeroll-worker");
  app.set_version_flag("--version", std::string("treeroll-worker ") + TREEROLL_VERSION);
  app.add_option("--processes", options.processes,
                 "Evaluator processes; default: one for each core");
  app.add_option("--lcm-url", options.lcm_url,
                 "Where the learners are; default: LCM_DEFAULT_URL, else LCM's own, this host");
  app.add_flag("--describe-task", options.describe_task,
               "Read {\"name\": ..., \"settings\": {...}} from standard input, print what the task "
               "says of itself or what is wrong, and end");
  app.add_flag(
      "--evaluate", options.evaluate,
      "Read {\"task\": {...}, \"policy\": TEXT, \"seed\": 0, \"trace\": false} from standard "
      "input, print the policy's reward, and end; treeroll-evaluate is more convenient");
  app.add_option("--evaluator", options.evaluator_socket)->group("");
  app.add_option("--parent", options.parent_pid)->group("");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::cerr << "treeroll-worker: " << error.what() << "\n";
    return 2;
  }
  try {
    if (options.evaluator_socket >= 0) {
      return worker::run_evaluator(registry, options.evaluator_socket, options.parent_pid);
    }
    if (options.evaluate) return worker::evaluate_policy(registry);
    if (options.describe_task) return worker::describe_task(registry);
    return worker::serve(options);
  } catch (const ConfigError& error) {
    std::cerr << "treeroll-worker: " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "treeroll-worker: " << error.what() << "\n";
    return 1;
  }
}

}  // namespace treeroll
