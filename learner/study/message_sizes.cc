#include "learner/study/message_sizes.h"

#include <fmt/format.h>

#include <cctype>
#include <cstddef>
#include <string_view>

#include "common/base/config_error.h"
#include "common/policy/policy.h"
#include "common/protocol/limits.h"
#include "common/protocol/wire_sizes.h"
#include "common/task_facts/task_description.h"

namespace treeroll {
namespace {

using protocol::kDefinitionBytesMax;
using protocol::kMessageBytesMax;
using protocol::kThetaDimMax;

static_assert(protocol::kRolloutBatchBytes + protocol::rollout_request_bytes(kThetaDimMax) <=
                  kMessageBytesMax,
              "one roll-out with the largest theta fits what an evaluator is given");

/// "-2.2250738585072014e-308"
constexpr std::size_t kLongestNumberBytes = 24;

/// Bytes of a JSON text if each of its numbers were as long as one can be: learning turns the
/// round numbers of a start into long ones.
std::size_t longest_form_bytes(std::string_view json) {
  std::size_t bytes = 0;
  std::size_t number = 0;
  bool in_string = false;
  for (const char c : json) {
    if (c == '"') in_string = !in_string;  // The keys of a policy hold no escaped quotes.
    const bool of_number = std::isdigit(static_cast<unsigned char>(c)) != 0 ||
                           std::string_view("+-.eE").find(c) != std::string_view::npos;
    if (!in_string && of_number) {
      ++number;
      continue;
    }
    bytes += 1 + (number > 0 ? kLongestNumberBytes : 0);
    number = 0;
  }
  return bytes + (number > 0 ? kLongestNumberBytes : 0);
}

void check_policy(const Policy& policy, const SignalNames& signals) {
  if (policy.theta_dim() > kThetaDimMax) {
    throw ConfigError("policy", "",
                      fmt::format("is too large: theta of layer {} has {} elements, must be at "
                                  "most {}",
                                  policy.layer(), policy.theta_dim(), kThetaDimMax));
  }
  // Where nobody here knows what the task calls its signals, its workers may tell.
  const std::size_t bytes =
      longest_form_bytes(to_json(policy, signals)) + (signals.empty() ? kTaskReportBytesMax : 0);
  if (bytes > kDefinitionBytesMax) {
    throw ConfigError("policy", "",
                      fmt::format("is too large to be sent: up to {} bytes at layer {}, must be "
                                  "at most {}",
                                  bytes, policy.layer(), kDefinitionBytesMax));
  }
}

}  // namespace

void check_message_sizes(const Condition& condition) {
  if (condition.task_content.size() > kDefinitionBytesMax) {
    throw ConfigError("task", "",
                      fmt::format("is too large to be sent: {} bytes, must be at most {}",
                                  condition.task_content.size(), kDefinitionBytesMax));
  }
  const explore::ExplorationSettings& exploration = condition.exploration;
  for (int layer = exploration.first_layer; layer <= exploration.last_layer; ++layer) {
    check_policy(*condition.start->at_layer(layer), condition.signals);
  }
}

}  // namespace treeroll
