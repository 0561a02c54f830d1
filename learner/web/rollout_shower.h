#pragma once

#include <deque>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/protocol/messages.h"
#include "common/transport/loop.h"
#include "learner/worker_program/process.h"

namespace treeroll::web {

/// The program that shows a roll-out: it is given the roll-out as its last argument, "3:17", and
/// prints one JSON object.
struct ShowingProgram {
  std::filesystem::path program;
  std::vector<std::string> arguments;
};

/// How its object begins if nothing could simulate the roll-out: keys stand in their order, and the
/// loop has no time to read all of it.
inline constexpr std::string_view kNotSimulated = R"({"again":{"failure":)";

struct ShowingLimits {
  /// A user's program may start twice: to describe its task, and to evaluate.
  Duration time = std::chrono::seconds(300);
  /// What failed, or was made before the roll-out had its result, is made again after this.
  Duration unsettled_for = std::chrono::seconds(5);
  std::size_t output_bytes_max = 16'000'000;
  std::size_t cache_bytes_max = 48'000'000;
  std::size_t waiting_max = 8;  ///< past it who has waited longest is forgotten
  int niceness = 15;
};

/// Shows roll-outs step by step, for which somebody must simulate: a process of its own does, one
/// at a time, of low priority and for a limited time. What it says is kept. Nothing blocks.
class RolloutShower {
 public:
  RolloutShower(transport::Loop& loop, ShowingProgram program, ShowingLimits limits = {});
  ~RolloutShower();
  RolloutShower(const RolloutShower&) = delete;
  RolloutShower& operator=(const RolloutShower&) = delete;

  /// Either is set, or neither while it is being made: then ask again.
  struct Shown {
    std::shared_ptr<const std::string> text = nullptr;
    std::string failure = {};
  };
  /// @param is_settled  it has its result: what is said now will always be said
  Shown show(protocol::RolloutKey key, bool is_settled);

 private:
  struct Kept {
    protocol::RolloutKey key;
    Shown shown = {};
    bool is_settled = false;
    TimePoint made_at = {};
  };
  struct Waiting {
    protocol::RolloutKey key;
    bool is_settled = false;
    TimePoint asked_at;
  };
  struct Work {
    protocol::RolloutKey key;
    bool is_settled = false;
    PipedChild child = {};
    std::string output = {};
    bool is_too_long = false;
    bool is_too_late = false;
  };

  void start_next();
  void start_one();
  void read();
  void give_up();
  void reap();
  void keep(Kept kept);

  transport::Loop& loop_;
  ShowingProgram program_;
  ShowingLimits limits_;
  std::deque<Waiting> waiting_;
  std::optional<Work> work_;
  std::list<Kept> kept_;  ///< asked for last in front
  std::size_t kept_bytes_ = 0;
  transport::Timer limit_timer_{loop_, [this] { give_up(); }};
  transport::Timer reap_timer_{loop_, [this] { reap(); }};
};

}  // namespace treeroll::web
