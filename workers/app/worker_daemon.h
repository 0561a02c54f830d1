#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/program/log.h"
#include "common/transport/bus.h"
#include "common/transport/bus_trouble.h"
#include "common/transport/loop.h"
#include "common/transport/service_manager.h"
#include "workers/app/evaluator_process.h"
#include "workers/core/worker_core.h"

namespace treeroll::worker {

/// Carries a worker core's effects out and its events in: the bus, the evaluator processes, the
/// clock, the signals and the log. One thread, the loop's.
class WorkerDaemon {
 public:
  /// Opens the bus. Fails with one line for a person; nothing has been started then.
  static Result<std::unique_ptr<WorkerDaemon>> open(const std::string& url,
                                                    std::optional<transport::KeyFile> key_file,
                                                    WorkerSettings settings,
                                                    EvaluatorSettings evaluators);
  ~WorkerDaemon();
  WorkerDaemon(const WorkerDaemon&) = delete;
  WorkerDaemon& operator=(const WorkerDaemon&) = delete;

  /// Serves until drained. @return exit status
  int run();

 private:
  /// An evaluator's place.
  struct Slot {
    std::optional<EvaluatorProcess> process;
    bool watched = false;
    std::optional<DefinitionName> loading;  ///< what its next report is about
  };

  WorkerDaemon() = default;

  void post(Event event);
  void schedule_flush();
  void flush();

  // What has content gives it away.
  void perform(SendMessage& effect);
  void perform(const StartEvaluator& effect);
  void perform(const EndEvaluator& effect);
  void perform(const KillEvaluator& effect);
  void perform(const LoadDefinition& effect);
  void perform(const ForgetDefinition& effect);
  void perform(RunRollouts& effect);
  void perform(const AskCpuTime& effect);
  void perform(const LogLine& line);
  void perform(const Exit& effect);

  Slot& slot_of(int evaluator) { return slots_.at(static_cast<std::size_t>(evaluator)); }
  void unwatch(Slot& slot);
  void give(int evaluator, const auto& packet);
  bool read_one(int evaluator);
  void understand(int evaluator, const protocol::Message& message);
  void collect_ended();
  void complain(std::string_view kind, std::string text);

  transport::Loop loop_;
  transport::ServiceManager manager_{loop_};
  transport::Timer timer_{loop_, [this] { post(TimerFired{}); }};
  std::unique_ptr<transport::Bus> bus_;
  EvaluatorSettings evaluators_;
  std::optional<WorkerCore> core_;
  std::vector<Slot> slots_;
  std::deque<Event> events_;
  bool working_ = false;
  bool flush_scheduled_ = false;
  std::optional<int> exit_status_;
  LimitedLog log_;
  transport::BusTrouble bus_trouble_;
};

}  // namespace treeroll::worker
