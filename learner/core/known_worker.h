#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/for_log.h"
#include "common/protocol/messages.h"

namespace treeroll {

/// A worker whose results follow in the journal: on what they were computed.
struct KnownWorker {
  protocol::WorkerId worker_id = 0;
  std::string numeric_class;  ///< workers of one class give the same bits for the same roll-out
  std::string host;
  std::int32_t pid = 0;  ///< for people, as the host
  bool operator==(const KnownWorker&) const = default;
};

/// Whether two have one vote as to what is right: processes of one host, and names of one key. Only
/// what the journal holds counts, so a fold counts alike. Without keys names begin at random; names
/// that begin with nothing are of no key.
inline bool are_one_witness(protocol::WorkerId a, std::string_view host_of_a, protocol::WorkerId b,
                            std::string_view host_of_b) {
  const std::int64_t key = protocol::key_part(a);
  return host_of_a == host_of_b || (key != 0 && key == protocol::key_part(b));
}
inline bool are_one_witness(const KnownWorker& a, const KnownWorker& b) {
  return are_one_witness(a.worker_id, a.host, b.worker_id, b.host);
}

/// "worker 5 (host pid 7)", for a log.
inline std::string described(const KnownWorker& worker) {
  return "worker " + std::to_string(worker.worker_id) + " (" + for_log(worker.host) + " pid " +
         std::to_string(worker.pid) + ")";
}

}  // namespace treeroll
