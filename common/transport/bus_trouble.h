#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/transport/bus.h"

namespace treeroll::transport {

/// What of a bus's statistics is worth a line of a daemon's log: the first trouble of each kind,
/// and then at each doubling, which is enough to see that it goes on.
class BusTrouble {
 public:
  /// To be called now and then. @return lines for a person
  std::vector<std::string> news(const BusStatistics& statistics);

 private:
  std::int64_t num_unsent_told_ = 0;
  std::int64_t num_rejected_told_ = 0;
  std::int64_t num_replayed_told_ = 0;
  std::string key_file_error_told_;
};

}  // namespace treeroll::transport
