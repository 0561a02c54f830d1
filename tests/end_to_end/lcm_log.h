#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/transport/channel.h"

namespace treeroll::end_to_end {

/// Two runs of 60 roll-outs that sleep.
inline std::string two_runs(const std::string& name, int duration_us) {
  return fmt::format(R"([study]
name = "{}"
repetitions = 2
rollouts = 60
[task]
name = "synthetic"
mode = "sleep"
duration_us = {}
[policy]
model = "tree"
components = [1, 2]
[exploration]
noise_variance = [0.01, 0.1, 0.01]
convergence_window = 10
first_update = 5
convergence_slope = 1
[[conditions]]
name = "tree"
)",
                     name, duration_us);
}
inline constexpr std::size_t kAskedOfTwoRuns = 2 * 60 + 4;  // and two evaluations of each run

inline std::optional<transport::Channel> channel_named(std::string_view name) {
  for (int i = 0; i < transport::kNumChannels; ++i) {
    const auto channel = static_cast<transport::Channel>(i);
    if (name == transport::channel_name(channel)) return channel;
  }
  return std::nullopt;
}

/// What stands in a log, or has been heard.
struct Told {
  std::int64_t time_us = 0;
  std::string channel;
  std::vector<std::byte> bytes;
};

inline std::vector<Told> events_of(const std::filesystem::path& path) {
  std::vector<Told> events;
  lcm::LogFile log(path.string(), "r");
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    const auto* bytes = static_cast<const std::byte*>(event->data);
    events.push_back({event->timestamp, event->channel, {bytes, bytes + event->datalen}});
  }
  return events;
}

}  // namespace treeroll::end_to_end
