#include "common/transport/bus_trouble.h"

#include <fmt/format.h>

namespace treeroll::transport {

std::vector<std::string> BusTrouble::news(const BusStatistics& statistics) {
  std::vector<std::string> lines;
  if (statistics.num_unsent > 2 * num_unsent_told_) {
    lines.push_back(fmt::format("{} messages could not be sent; the last: {}",
                                statistics.num_unsent, statistics.last_publish_error));
    num_unsent_told_ = statistics.num_unsent;
  }
  if (statistics.num_rejected > 2 * num_rejected_told_) {
    lines.push_back(fmt::format("{} messages refused; the last: {}", statistics.num_rejected,
                                statistics.last_rejection));
    num_rejected_told_ = statistics.num_rejected;
  }
  if (statistics.num_replayed > 2 * num_replayed_told_) {
    lines.push_back(fmt::format(
        "{} signed messages came a second time, or late, and were refused: the network doubles or "
        "delays them, or somebody plays a recording",
        statistics.num_replayed));
    num_replayed_told_ = statistics.num_replayed;
  }
  if (statistics.key_file_error != key_file_error_told_) {
    key_file_error_told_ = statistics.key_file_error;
    if (!key_file_error_told_.empty()) {
      lines.push_back(fmt::format("the keys stay as they were: {}", key_file_error_told_));
    }
  }
  return lines;
}

}  // namespace treeroll::transport
