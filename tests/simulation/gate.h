#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/transport/authenticator.h"
#include "tests/simulation/node.h"

namespace treeroll::simulation {

/// A message as it travels where there are keys: with its signed bytes.
struct Datagram : protocol::Message {
  Datagram(protocol::Message message, std::vector<std::byte> signed_bytes)
      : protocol::Message(std::move(message)), bytes(std::move(signed_bytes)) {}
  std::vector<std::byte> bytes;
};

/// Whose keys a process has.
enum class Keys { kNone, kLearner, kWorker };

/// Between a process and its network: signs what goes out and admits what comes in, with the
/// shipped authentication. Without keys everything passes as it is.
class Gate {
 public:
  Gate() = default;
  /// @param host  of a worker: its keys are its own
  Gate(Keys keys, int host);

  /// The name that a worker of this host may take.
  static std::int64_t name_of(bool has_keys, int host, std::int64_t random);

  Node::MessagePointer seal(const Node::MessagePointer& message);
  bool admits(const protocol::Message& message);

 private:
  std::optional<transport::Authenticator> authenticator_;
};

}  // namespace treeroll::simulation
