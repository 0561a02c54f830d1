#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "common/protocol/messages.h"
#include "tests/simulation/dice.h"
#include "tests/simulation/node.h"
#include "tests/simulation/observer.h"
#include "tests/simulation/scenario.h"
#include "tests/simulation/stranger.h"

namespace treeroll::simulation {

/// Carries messages between the learner and the worker slots, or does not. A worker hears all that
/// the learner says; what a worker says is for the learner alone.
class Network {
 public:
  enum class Direction { kToWorker, kToLearner };
  using Deliver = std::function<void(int slot, Direction, Node::MessagePointer)>;

  Network(const Scenario& scenario, Schedule& schedule, Observer& observer, Deliver deliver);

  void send(int slot, Direction direction, const Node::MessagePointer& message);
  /// Counts it; across hosts it must fit a frame, since no path carries what does not.
  void note_published(const Node::MessagePointer& message);
  /// Of messages published so far, with LCM's header.
  std::int64_t num_bytes() const { return num_bytes_; }
  /// Nothing passes to or from this slot until `end`.
  void cut(int slot, TimePoint end);
  /// Nothing reaches this slot any more.
  void deafen(int slot) { deaf_.insert(slot); }
  /// Says again all that has been said so far, over and over.
  void play_back(double speed);
  /// Proves that the message can be sent: through the codec and back to the same value.
  void check_encoding(const protocol::Message& message);

 private:
  bool is_lost(int slot, Direction direction, const protocol::Message& message);
  void record(int slot, Direction direction, const Node::MessagePointer& message);
  void play_from(std::size_t place, double speed);
  void carry(int slot, Direction direction, const Node::MessagePointer& message);
  void let_stranger_speak(int slot, Direction direction, const Node::MessagePointer& heard);
  void check_truncated(const protocol::Message& message);

  const Scenario& scenario_;
  Schedule& schedule_;
  Observer& observer_;
  Deliver deliver_;
  Dice dice_;
  Stranger stranger_;
  std::int64_t num_bytes_ = 0;
  std::map<int, TimePoint> cut_until_;
  std::set<int> deaf_;
  struct Recorded {
    TimePoint time;
    int slot = 0;
    Direction direction{};
    Node::MessagePointer message;
  };
  std::vector<Recorded> recording_;  ///< of what was said first
  bool playing_ = false;
  std::map<std::pair<int, Direction>, TimePoint> last_arrival_;
};

}  // namespace treeroll::simulation
