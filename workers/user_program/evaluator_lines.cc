#include "workers/user_program/evaluator_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <vector>

#include "common/base/cut_text.h"
#include "common/base/for_log.h"
#include "common/base/json_text.h"
#include "workers/tasks/trace.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;

constexpr int kNestingMax = 64;

/// What is wrong with an answer; never leaves this file.
class BadAnswer : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

json parsed(std::string_view line) {
  Result<json> said = parse_json(line, kNestingMax);
  if (!said) throw BadAnswer("an answer " + said.error().message);
  if (!said->is_object()) throw BadAnswer("an answer must be a JSON object");
  return *std::move(said);
}

void need_known_keys(const json& said, const std::set<std::string>& known) {
  for (const auto& [key, value] : said.items()) {
    if (!known.contains(key)) throw BadAnswer("an answer has no key '" + key + "'");
  }
}

std::string text_at(const json& said, const char* key) {
  const json& text = said.at(key);
  if (!text.is_string()) throw BadAnswer(fmt::format("'{}' must be a string", key));
  return text.get<std::string>();
}

/// JSON has no word for what is not finite: null stands for it.
double number_of(const json& number, const char* where) {
  if (number.is_null()) return std::numeric_limits<double>::quiet_NaN();
  if (!number.is_number()) throw BadAnswer(fmt::format("'{}' must hold numbers", where));
  return number.get<double>();
}

std::vector<std::string> names_at(const json& said, const char* key) {
  std::vector<std::string> names;
  if (!said.contains(key)) return names;
  if (!said[key].is_array()) throw BadAnswer(fmt::format("'{}' must be a list of names", key));
  for (const json& name : said[key]) {
    if (!name.is_string()) throw BadAnswer(fmt::format("'{}' must be a list of names", key));
    names.push_back(name.get<std::string>());
  }
  return names;
}

Pose pose_of(const json& lines) {
  Pose pose;
  if (!lines.is_array()) throw BadAnswer("a pose must be a list of lines");
  for (const json& line : lines) {
    if (!line.is_array() || line.size() % 2 != 0) {
      throw BadAnswer("a line of a pose must be a list [x, y, x, y, ...]");
    }
    pose.emplace_back();
    for (std::size_t i = 0; i < line.size(); i += 2) {
      pose.back().push_back({number_of(line[i], "poses"), number_of(line[i + 1], "poses")});
    }
  }
  return pose;
}

/// Checks all that Trace itself takes for granted.
void read_trace(const json& said, Trace& trace) {
  if (!said.is_object()) throw BadAnswer("'trace' must be an object");
  need_known_keys(said, {"columns", "rows", "policy_inputs", "policy_outputs", "poses"});
  const std::vector<std::string> columns = names_at(said, "columns");
  if (columns.empty() || !said.contains("rows") || !said["rows"].is_array()) {
    throw BadAnswer("'trace' must have columns and rows");
  }
  const json none = json::array();
  const json& poses = said.contains("poses") ? said["poses"] : none;
  if (!poses.is_array() || (!poses.empty() && poses.size() != said["rows"].size())) {
    throw BadAnswer("'poses' must have one pose for each row, or be left out");
  }
  const auto inputs = names_at(said, "policy_inputs");
  const auto outputs = names_at(said, "policy_outputs");
  for (const auto* names : {&inputs, &outputs}) {
    for (const std::string& name : *names) {
      if (std::ranges::find(columns, name) == columns.end()) {
        throw BadAnswer(fmt::format("'{}' must be a column of the trace", name));
      }
    }
  }
  trace.set_columns(columns);
  trace.set_policy_columns(inputs, outputs);
  std::vector<double> numbers;
  for (std::size_t i = 0; i < said["rows"].size(); ++i) {
    const json& row = said["rows"][i];
    if (!row.is_array() || row.size() != columns.size()) {
      throw BadAnswer("a row of a trace must have a number for each column");
    }
    numbers.clear();
    for (const json& number : row) numbers.push_back(number_of(number, "rows"));
    trace.add_row(numbers);
    if (!trace.is_complete()) return;
    if (!poses.empty()) trace.add_pose(pose_of(poses[i]));
    if (!trace.is_complete()) return;
  }
}

std::map<std::string, double> terms_of(const json& said) {
  std::map<std::string, double> terms;
  if (!said.contains("terms")) return terms;
  if (!said["terms"].is_object() || said["terms"].size() > Trace::kTermsMax) {
    throw BadAnswer(
        fmt::format("'terms' must be an object of at most {} numbers", Trace::kTermsMax));
  }
  for (const auto& [name, number] : said["terms"].items()) {
    const std::string shown = for_log(name);
    if (shown.empty() || shown.size() > Trace::kTermNameBytesMax) {
      throw BadAnswer(fmt::format("the name of a term must have 1 to {} bytes: '{}'",
                                  Trace::kTermNameBytesMax, cut_text(shown, 100)));
    }
    terms[shown] = number_of(number, "terms");
  }
  return terms;
}

Outcome outcome_of(const json& said, const TaskDescription& task) {
  const int num_words = static_cast<int>(said.contains("reward")) +
                        static_cast<int>(said.contains("failed")) +
                        static_cast<int>(said.contains("discarded"));
  if (num_words != 1) {
    throw BadAnswer("an answer must have one of 'reward', 'failed' and 'discarded'");
  }
  const auto reason = [&](const char* key) {
    return cut_text(for_log(text_at(said, key)), kOutcomeReasonBytesMax);
  };
  if (said.contains("failed")) return Outcome::failed(RolloutStatus::kFailed, reason("failed"));
  if (said.contains("discarded")) return Outcome::discarded(reason("discarded"));
  if (!said["reward"].is_number()) throw BadAnswer("'reward' must be a number");
  const auto reward = said["reward"].get<double>();
  if (!std::isfinite(reward) || !task.is_in_range(reward)) {
    throw BadAnswer(fmt::format("the reward {} is outside its range {} .. {}", reward,
                                task.reward_min, task.reward_max));
  }
  return Outcome::ok(reward);
}

}  // namespace

bool is_answer(std::string_view line) {
  constexpr std::string_view kBlanks = " \t";
  const std::size_t brace = line.find_first_not_of(kBlanks);
  if (brace == std::string_view::npos || line[brace] != '{') return false;
  const std::size_t key = line.find_first_not_of(kBlanks, brace + 1);
  // An indented line may be part of what is printed for people: it must be whole.
  const bool begins_as_one = brace == 0 && key != std::string_view::npos && line[key] == '"';
  return begins_as_one || json::accept(line);
}

std::string describe_line(const std::string& name, const json& settings) {
  const json asked{{"describe", {{"name", name}, {"settings", settings}}}};
  return asked.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
}

// The policy's text goes in as it stands: parsing it only to write it again would take as long as
// all the rest. It is ours, one line without a line break.
std::string evaluate_line(std::int64_t run, std::int64_t rollout, std::uint64_t seed,
                          const std::string& policy, bool trace) {
  return fmt::format(
      R"({{"evaluate": {{"run": {}, "rollout": {}, "seed": {}, "trace": {}, "policy": {}}}}})"
      "\n",
      run, rollout, seed, trace, policy);
}

Result<DescribeAnswer> read_describe_answer(std::string_view line) {
  try {
    json said = parsed(line);
    DescribeAnswer answer;
    if (said.contains("refused")) {
      need_known_keys(said, {"refused"});
      answer.refusal = for_log(text_at(said, "refused"));
      return answer;
    }
    if (const auto settings = said.find("settings"); settings != said.end()) {
      if (!settings->is_object()) throw BadAnswer("'settings' must be an object");
      answer.settings = settings->dump(-1, ' ', false, json::error_handler_t::replace);
      said.erase(settings);
    }
    const Result<TaskDescription> description =
        task_description_from_json(said.dump(-1, ' ', false, json::error_handler_t::replace));
    if (!description) throw BadAnswer(description.error().message);
    answer.description = *description;
    return answer;
  } catch (const BadAnswer& error) {
    return Error{error.what()};
  }
}

EvaluateAnswer read_evaluate_answer(std::string_view line, const TaskDescription& task,
                                    Trace* trace) {
  try {
    const json said = parsed(line);
    need_known_keys(said, {"reward", "failed", "discarded", "terms", "trace"});
    EvaluateAnswer answer{.outcome = outcome_of(said, task), .terms = terms_of(said)};
    if (trace != nullptr && said.contains("trace")) read_trace(said["trace"], *trace);
    return answer;
  } catch (const BadAnswer& error) {
    return {.outcome = Outcome::failed(
                RolloutStatus::kFailed,
                cut_text(for_log(std::string(kNoAnswer) + error.what()), kOutcomeReasonBytesMax))};
  }
}

}  // namespace treeroll::worker
