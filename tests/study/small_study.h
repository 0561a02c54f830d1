#pragma once

#include <string>

namespace treeroll::study_test {

/// A study with one condition, a line a setting: tests append to it or replace its lines.
inline const std::string kSmallStudy = R"([study]
name = "small"
rollouts = 30
[task]
name = "swing_up"
plant = "rk4"
step_s = 0.005
[policy]
model = "top_down_tree"
[exploration]
noise_variance = [0.01, 0.3, 0.02]
[[conditions]]
name = "tree"
)";

/// The study with `from`, which it holds, replaced.
inline std::string with(const std::string& from, const std::string& to) {
  std::string text = kSmallStudy;
  return text.replace(text.find(from), from.size(), to);
}

}  // namespace treeroll::study_test
