#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/protocol/messages.h"
#include "common/transport/channel.h"
#include "common/transport/key_ring.h"
#include "common/transport/replay_window.h"

namespace treeroll::transport {

/// Signs what a process says, and tells what others say from what strangers do. Pure: a function of
/// its keys and of the messages it has seen. lcmtypes/PROTOCOL.md says what is signed and why it is
/// enough; in short:
///
///  - Every id is drawn at random by a process at its start. So a message that names us was made
///    after we began. It proves that its sender lives; what that one says after it is taken, each
///    message once. Before, only the two statuses are, by which strangers meet.
///  - Workers sign with a key of their own. What a learner says to all is signed with a key that
///    they share, and what it says to one of them also with the key of that one. So no worker
///    speaks for another one, or leases anything.
class Authenticator {
 public:
  /// @param only_watches  says nothing that is answered, so nobody can prove to it that he lives:
  ///                      whatever is signed is taken, once each
  /// @param last_index    as if so many messages had been signed
  explicit Authenticator(KeyRing keys, bool only_watches = false, std::int64_t last_index = 0);

  /// From now on with these. Who is known stays known: a worker's key that follows from these too
  /// is kept, and of one that does not the one that does is taken for it.
  void set_keys(KeyRing keys);

  /// Completes what encode() has made of the message. Precondition: what a learner says is signed
  /// by a ring of a learner.
  void sign(const protocol::Message& message, std::vector<std::byte>& bytes);

  /// Why these bytes are not what a holder of a key has signed; empty if they are. To be asked
  /// before they are decoded.
  std::optional<std::string> refusal(Channel channel, std::span<const std::byte> bytes);

  enum class Admission {
    kTaken,
    kUnproven,  ///< its sender has not shown yet that it lives
    kReplayed,  ///< it has come before, or is older than what proved that its sender lives
    kForged,    ///< names us without our key
  };
  /// Of a message that is signed, as decode() has read it.
  Admission admit(const protocol::Message& message, std::span<const std::byte> bytes);

 private:
  using SenderId = std::int64_t;  ///< of a worker or a learner
  struct Sender {
    std::optional<WorkerKey> key;        ///< of a worker; nothing while the ring is new
    std::optional<ReplayWindow> window;  ///< once it has proved that it lives
    /// Of a learner: of its words to us, which nobody else can sign. Announcements move the other.
    std::optional<ReplayWindow> words;
    std::uint64_t heard = 0;  ///< by our count
  };
  struct Announcements {
    std::int64_t id = 0;
    Key key{};
  };

  Sender& sender(SenderId id);
  const WorkerKey* key_of(SenderId worker) const;
  const std::vector<WorkerKey>& own_keys(SenderId worker);
  std::map<SenderId, Sender>::iterator to_put_out(SenderId for_whom);
  void note_own(SenderId id, bool as_worker);
  bool is_own(SenderId id) const { return own_.contains(id); }
  bool names_us(const protocol::Message& message) const;
  Admission admit_word(SenderId from, std::int64_t index);
  bool words_are_right(const protocol::RolloutBatch& batch, std::span<const std::byte> bytes);
  std::optional<std::string> refusal_of_worker(Channel channel, std::span<const std::byte> bytes);

  KeyRing keys_;
  bool only_watches_;
  std::vector<Announcements> announcements_;
  std::map<SenderId, Sender> senders_;
  std::uint64_t num_heard_ = 0;
  std::map<SenderId, bool> own_;  ///< whether it speaks as a worker; else as a learner
  std::deque<SenderId> own_row_;  ///< oldest first
  std::map<SenderId, std::vector<WorkerKey>> own_keys_;
  std::int64_t last_index_;
};

}  // namespace treeroll::transport
