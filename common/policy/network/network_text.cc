#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/policy/input_range.h"
#include "common/policy/network/network_policy.h"

namespace treeroll {
namespace {

using nlohmann::json;

std::vector<Network::Range> read_ranges(const PolicyText& ranges) {
  std::vector<Network::Range> all(ranges.list_size(1, NetworkPolicy::kSignalsMax));
  for (std::size_t i = 0; i < all.size(); ++i) {
    ranges.at(i).list_size(2, 2);
    all[i] = {ranges.at(i).at(0).number(), ranges.at(i).at(1).number()};
    if (!is_input_range(all[i].low, all[i].high)) ranges.at(i).refuse(kInputRangeRule);
  }
  return all;
}

}  // namespace

json NetworkPolicy::content() const {
  json ranges = json::array();
  for (const Network::Range& range : network_.ranges) ranges.push_back({range.low, range.high});
  return {{"ranges", ranges},
          {"outer", json_rows(network_.outer)},
          {"inner", json_rows(network_.inner)}};
}

PolicyPtr network_from_content(const PolicyText& content) {
  content.need_keys({"inner", "outer", "ranges"});
  Network network{.ranges = read_ranges(content.at("ranges")), .outer = {}, .inner = {}};
  const std::size_t of_hidden = network.ranges.size() + 1;
  network.inner = content.at("inner").rows({1, NetworkPolicy::kHiddenMax}, {of_hidden, of_hidden});
  const auto of_output = static_cast<std::size_t>(network.num_hidden()) + 1;
  network.outer = content.at("outer").rows({1, NetworkPolicy::kSignalsMax}, {of_output, of_output});
  try {
    return std::make_shared<NetworkPolicy>(std::move(network));
  } catch (const std::invalid_argument& error) {
    content.refuse(error.what());
  }
}

}  // namespace treeroll
