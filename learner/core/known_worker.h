#pragma once

#include <cstdint>
#include <string>

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
inline bool are_one_witness(const KnownWorker& a, const KnownWorker& b) {
  const std::int64_t key = protocol::key_part(a.worker_id);
  return a.host == b.host || (key != 0 && key == protocol::key_part(b.worker_id));
}

/// "worker 5 (host pid 7)", for a log.
inline std::string described(const KnownWorker& worker) {
  return "worker " + std::to_string(worker.worker_id) + " (" + for_log(worker.host) + " pid " +
         std::to_string(worker.pid) + ")";
}

}  // namespace treeroll
