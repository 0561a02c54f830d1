#include "tests/simulation/gate.h"

#include "common/base/check.h"
#include "common/transport/codec.h"

namespace treeroll::simulation {
namespace {

transport::Key cluster_key() {
  transport::Key key{};
  key.fill(42);
  return key;
}

/// The first bits of the names of its processes.
std::int64_t key_id(int host) { return std::int64_t{1 + host} << 40U; }

transport::KeyRing ring_of(Keys keys, int host) {
  auto ring = transport::KeyRing::parse(
      keys == Keys::kLearner
          ? transport::line_of(cluster_key())
          : transport::line_of(transport::worker_key(cluster_key(), key_id(host))));
  CHECK(ring, "keys that are read");
  return *std::move(ring);
}

}  // namespace

Gate::Gate(Keys keys, int host) {
  if (keys != Keys::kNone) authenticator_.emplace(ring_of(keys, host));
}

std::int64_t Gate::name_of(bool has_keys, int host, std::int64_t random) {
  return has_keys ? ring_of(Keys::kWorker, host).worker_id(random) : random;
}

Node::MessagePointer Gate::seal(const Node::MessagePointer& message) {
  if (!authenticator_) return message;
  std::vector<std::byte> bytes = transport::encode(*message);
  authenticator_->sign(*message, bytes);
  return std::make_shared<const Datagram>(*message, std::move(bytes));
}

bool Gate::admits(const protocol::Message& message) {
  if (!authenticator_) return true;
  const std::vector<std::byte>& bytes = static_cast<const Datagram&>(message).bytes;
  const transport::Channel channel = transport::channel_of(message);
  return !authenticator_->refusal(channel, bytes) &&
         authenticator_->admit(message, bytes) == transport::Authenticator::Admission::kTaken;
}

}  // namespace treeroll::simulation
