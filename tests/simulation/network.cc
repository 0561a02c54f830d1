#include "tests/simulation/network.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <span>

#include "common/protocol/limits.h"
#include "common/protocol/wire_sizes.h"
#include "common/transport/codec.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint32_t kNetworkDice = 3;
/// One message in so many also goes through the codec, which takes longer than the rest.
constexpr double kEncodedShare = .02;
/// A recording is short: what it can do it does at each turn.
constexpr std::size_t kRecordedMax = 200;
constexpr Duration kRewindTime = std::chrono::milliseconds(200);

}  // namespace

Network::Network(const Scenario& scenario, Schedule& schedule, Observer& observer, Deliver deliver)
    : scenario_(scenario),
      schedule_(schedule),
      observer_(observer),
      deliver_(std::move(deliver)),
      dice_(scenario.seed, kNetworkDice),
      stranger_(scenario.seed, scenario.has_keys) {}

void Network::send(int slot, Direction direction, const Node::MessagePointer& message) {
  if (dice_.chance(kEncodedShare)) check_encoding(*message);
  record(slot, direction, message);
  let_stranger_speak(slot, direction, message);
  if (is_lost(slot, direction, *message)) return;
  carry(slot, direction, message);
  const bool faulty = schedule_.now() < scenario_.faults_end;
  if (faulty && dice_.chance(scenario_.network.duplication)) {
    observer_.count("messages duplicated");
    carry(slot, direction, message);
  }
}

void Network::let_stranger_speak(int slot, Direction direction, const Node::MessagePointer& heard) {
  if (scenario_.stranger_share == 0 || !dice_.chance(scenario_.stranger_share)) return;
  observer_.count("messages of strangers");
  const Duration delay = dice_.between(Duration{}, kStragglerDelay);
  schedule_.after(delay, [this, slot, direction, said = stranger_.answer(heard)] {
    deliver_(slot, direction, said);
  });
}

void Network::note_published(const Node::MessagePointer& message) {
  // On one host any size goes, and encoding takes longer than all the rest.
  if (scenario_.batch_bytes_max > protocol::kBatchBytesRemoteMax) return;
  const std::size_t size = protocol::kFrameHeaderBytes +
                           std::strlen(transport::channel_name(transport::channel_of(*message))) +
                           1 +
                           (scenario_.has_keys ? static_cast<const Datagram&>(*message).bytes.size()
                                               : transport::encode(*message).size());
  num_bytes_ += static_cast<std::int64_t>(size);
  observer_.require(size <= protocol::kBatchBytesRemoteMax, "a message is larger than a frame");
}

void Network::cut(int slot, TimePoint end) {
  TimePoint& until = cut_until_[slot];
  until = std::max(until, end);
}

void Network::record(int slot, Direction direction, const Node::MessagePointer& message) {
  if (playing_ || recording_.size() >= kRecordedMax) return;
  recording_.push_back({schedule_.now(), slot, direction, message});
}

void Network::play_back(double speed) {
  playing_ = true;
  if (recording_.empty()) return;
  play_from(0, speed);
}

void Network::play_from(std::size_t place, double speed) {
  const Recorded& now = recording_[place];
  observer_.count("messages played again");
  deliver_(now.slot, now.direction, now.message);
  const bool is_last = place + 1 == recording_.size();
  const Duration wait = is_last ? kRewindTime : recording_[place + 1].time - now.time;
  schedule_.after(Duration(static_cast<Duration::rep>(static_cast<double>(wait.count()) / speed)),
                  [this, next = is_last ? 0 : place + 1, speed] { play_from(next, speed); });
}

bool Network::is_lost(int slot, Direction direction, const protocol::Message& message) {
  if (direction == Direction::kToWorker && deaf_.contains(slot)) {
    observer_.count("messages to the deaf");
    return true;
  }
  if (schedule_.now() >= scenario_.faults_end) return false;
  if (const auto cut = cut_until_.find(slot);
      cut != cut_until_.end() && schedule_.now() < cut->second) {
    observer_.count("messages lost in a partition");
    return true;
  }
  if (dice_.chance(scenario_.network.loss)) {
    observer_.count("messages lost");
    return true;
  }
  if (dice_.chance(scenario_.network.truncation)) {
    observer_.count("messages truncated");
    check_truncated(message);
    return true;
  }
  return false;
}

void Network::carry(int slot, Direction direction, const Node::MessagePointer& message) {
  const NetworkFaults& faults = scenario_.network;
  Duration delay = dice_.between(faults.delay_min, faults.delay_max);
  if (schedule_.now() < scenario_.faults_end && dice_.chance(faults.straggling)) {
    observer_.count("messages late");
    delay += dice_.between(Duration{}, kStragglerDelay);
  }
  TimePoint arrival = schedule_.now() + delay;
  TimePoint& last = last_arrival_[{slot, direction}];
  if (faults.reorders) {
    if (arrival < last) observer_.count("messages overtaking");
  } else {
    arrival = std::max(arrival, last);
  }
  last = std::max(last, arrival);
  schedule_.at(arrival, [this, slot, direction, message] { deliver_(slot, direction, message); });
}

void Network::check_encoding(const protocol::Message& message) {
  observer_.count("messages encoded");
  const std::vector<std::byte> bytes = transport::encode(message);
  observer_.require(bytes.size() <= protocol::kMessageBytesMax, "a message is too large to send");
  const auto decoded = transport::decode(transport::channel_of(message), bytes);
  observer_.require(static_cast<bool>(decoded), "a message would be refused by its receiver");
  if (decoded) observer_.require(*decoded == message, "a message changes on its way");
}

void Network::check_truncated(const protocol::Message& message) {
  const std::vector<std::byte> bytes = transport::encode(message);
  const auto size = static_cast<std::size_t>(dice_.between(0, static_cast<int>(bytes.size()) - 1));
  const std::span<const std::byte> part(bytes.data(), size);
  observer_.require(transport::refusal(transport::channel_of(message), part).has_value(),
                    "a truncated message is not refused");
}

}  // namespace treeroll::simulation
