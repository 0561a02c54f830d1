#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/outcome.h"
#include "common/base/result.h"
#include "common/task_facts/task_description.h"

namespace treeroll {
class Trace;
}

/// The lines that are exchanged with a user's program, as EVALUATOR.md has them: text in, values
/// out. What a program says comes from outside and is checked whole. Numbers in brackets are those
/// of the rules there.
namespace treeroll::worker {

/// Of one answer, the line break included; that of an evaluation that asked for a trace has room
/// for two million numbers. [7]
inline constexpr std::size_t kAnswerBytesMax = std::size_t{1} << 20U;
inline constexpr std::size_t kTraceAnswerBytesMax = 64'000'000;

/// Whether a line of standard output is meant as an answer; all others are for the log. [5]
bool is_answer(std::string_view line);

// What the program is asked, one line each, with its line break.

std::string describe_line(const std::string& name, const nlohmann::json& settings);
/// @param policy  text of a policy with the roll-out's theta (common/policy/policy.h)
std::string evaluate_line(std::int64_t run, std::int64_t rollout, std::uint64_t seed,
                          const std::string& policy, bool trace);

// What it answers.

struct DescribeAnswer {
  TaskDescription description;
  /// With the program's defaults; nothing if it does not say, and those it was asked with hold.
  std::optional<std::string> settings = {};
  /// Else why it does not take the task. [10]
  std::optional<std::string> refusal = {};
};
/// An error says which rule the line breaks.
Result<DescribeAnswer> read_describe_answer(std::string_view line);

struct EvaluateAnswer {
  Outcome outcome;
  /// What the reward is made of, by name, for people.
  std::map<std::string, double> terms = {};
};
/// A reason of ours for a roll-out that has failed begins so.
inline constexpr std::string_view kNoAnswer = "the program's answer is none: ";

/// An answer that breaks a rule is a failed roll-out, and the reason names the rule.
/// @param trace  receives the roll-out step by step, if it was asked for; may be null
EvaluateAnswer read_evaluate_answer(std::string_view line, const TaskDescription& task,
                                    Trace* trace);

}  // namespace treeroll::worker
