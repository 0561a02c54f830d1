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
  return lines;
}

}  // namespace treeroll::transport
