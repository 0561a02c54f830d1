#include "workers/user_program/user_program.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/base/config_error.h"
#include "common/base/for_log.h"

namespace treeroll::worker {
namespace {

using What = ProgramProcess::Heard::What;
using nlohmann::json;

constexpr std::size_t kShownBytesMax = 200;

// Their numbers in EVALUATOR.md.
constexpr int kRuleOfAnswers = 3;
constexpr int kRuleOfOneAnswer = 6;
constexpr int kRuleOfLength = 7;
constexpr int kRuleOfEnds = 18;

/// How long a program may talk without a pause where it is to be asked.
constexpr std::chrono::seconds kTalkMax(1);

bool can_be_read(int descriptor) {
  pollfd one{descriptor, POLLIN, 0};
  return poll(&one, 1, 0) > 0;
}

std::string in_words(const ProgramEnd& end) {
  return fmt::format("{} {}", end.exited ? "ended with status" : "was ended by signal", end.code);
}

/// "goal_m: must be positive" is about that setting; any other text about the task.
[[noreturn]] void refuse(const std::string& refusal, const std::string& name,
                         const json& settings) {
  const std::size_t colon = refusal.find(": ");
  const std::string key = refusal.substr(0, colon);
  const bool is_name =
      colon != std::string::npos && !key.empty() && std::ranges::all_of(key, [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '_' || c == '.';
      });
  if (!is_name) throw ConfigError("task", '"' + name + '"', "is refused: " + refusal);
  json value;
  if (key == "name") value = name;
  if (settings.contains(key)) value = settings[key];
  const std::string shown =
      value.is_null() ? "" : value.dump(-1, ' ', false, json::error_handler_t::replace);
  throw ConfigError("task." + key, shown.substr(0, kShownBytesMax), refusal.substr(colon + 2));
}

}  // namespace

UserProgram::UserProgram(ProgramSettings settings, Log log)
    : settings_(std::move(settings)), log_(std::move(log)), process_(settings_.words) {}

UserProgram::~UserProgram() {
  try {
    dismiss();
  } catch (const std::runtime_error&) {
    // It cannot be waited for: its process is killed at once.
  }
}

/// What it still says is heard: no full pipe may keep it from its end.
void UserProgram::dismiss() {
  process_.terminate();
  const auto deadline = std::chrono::steady_clock::now() + kProgramEndGrace;
  while (std::chrono::steady_clock::now() < deadline) {
    const ProgramProcess::Heard heard = process_.hear(kAnswerBytesMax, deadline, {});
    if (heard.what == What::kEnded) return;
    if (heard.what == What::kTooLong) {
      process_.drop_output();
    } else if (heard.what != What::kLate) {
      note(heard.line);
    }
  }
  process_.kill();
}

void UserProgram::note(std::string_view line) {
  last_words_ = for_log(line);
  log_(where_, last_words_);
}

void UserProgram::throw_ended(const std::string& what) {
  throw ProgramEnded{process_.end(), kRuleOfEnds,
                     fmt::format("the program {} {}{}", what, where_,
                                 last_words_.empty() ? "" : "; it last said: " + last_words_)};
}

/// A signal of ours would be nobody's fault; this end is the program's own.
void UserProgram::end_it(int rule, const std::string& why) {
  dismiss();
  throw ProgramEnded{
      {.exited = true, .code = 1}, rule, fmt::format("the program is ended {}: {}", where_, why)};
}

std::string UserProgram::ask(const std::string& line, std::size_t answer_bytes_max) {
  // An answer that nobody has asked for would be taken for that of this question.
  const auto talks_until = std::chrono::steady_clock::now() + kTalkMax;
  while (hear_unasked(std::chrono::steady_clock::now(), {})) {
    if (std::chrono::steady_clock::now() > talks_until) {
      end_it(kRuleOfOneAnswer, "it writes without a pause, so that no answer could be told");
    }
  }
  process_.send(line);
  ProgramProcess::Deadline deadline;
  if (answer_limit_) deadline = std::chrono::steady_clock::now() + *answer_limit_;
  for (;;) {
    ProgramProcess::Heard heard = process_.hear(answer_bytes_max, deadline, {socket_, POLLRDHUP});
    if (heard.what == What::kAlso) end_it(kRuleOfEnds, "its worker has stopped it");
    if (heard.what == What::kEnded) throw_ended(in_words(process_.end()));
    if (heard.what == What::kTooLong) {
      end_it(kRuleOfLength, fmt::format("a line of more than {} bytes", answer_bytes_max));
    }
    if (heard.what == What::kLate) {
      end_it(kRuleOfAnswers, fmt::format("no answer within {} ms", answer_limit_->count()));
    }
    if (heard.what == What::kOutput && is_answer(heard.line)) return std::move(heard.line);
    note(heard.line);
    if (deadline && std::chrono::steady_clock::now() > *deadline) {
      end_it(kRuleOfAnswers,
             fmt::format("no answer within {} ms, but talk", answer_limit_->count()));
    }
  }
}

bool UserProgram::hear_unasked(ProgramProcess::Deadline deadline, ProgramProcess::Also also) {
  const ProgramProcess::Heard heard = process_.hear(kAnswerBytesMax, deadline, also);
  if (heard.what == What::kLate || heard.what == What::kAlso) return false;
  if (heard.what == What::kEnded) throw_ended(in_words(process_.end()));
  if (heard.what == What::kTooLong) {
    end_it(kRuleOfLength, fmt::format("a line of more than {} bytes", kAnswerBytesMax));
  }
  if (heard.what == What::kOutput && is_answer(heard.line)) {
    end_it(kRuleOfOneAnswer, "it answers what it was not asked: " + for_log(heard.line));
  }
  note(heard.line);
  return true;
}

void UserProgram::attend(int socket) {
  socket_ = socket;
  while (hear_unasked(std::nullopt, {socket, POLLIN}) && !can_be_read(socket)) {
  }
}

void UserProgram::attend_for(std::chrono::milliseconds time) {
  const auto deadline = std::chrono::steady_clock::now() + time;
  while (std::chrono::steady_clock::now() < deadline && hear_unasked(deadline, {})) {
  }
}

DescribeAnswer UserProgram::describe(const std::string& name, const json& settings) {
  where_ = fmt::format("at task \"{}\"", for_log(name));
  const std::string line = ask(describe_line(name, settings), kAnswerBytesMax);
  Result<DescribeAnswer> answer = read_describe_answer(line);
  if (!answer) {
    throw ConfigError("task", '"' + name + '"',
                      fmt::format("must be described by {}: {}; it says {}", settings_.command,
                                  answer.error().message, for_log(line).substr(0, kShownBytesMax)));
  }
  if (answer->refusal) refuse(*answer->refusal, name, settings);
  return *std::move(answer);
}

EvaluateAnswer UserProgram::evaluate(const ProgramRollout& rollout, const TaskDescription& task,
                                     Trace* trace) {
  where_ = fmt::format("in run {}, roll-out {}", rollout.run, rollout.rollout);
  const std::string line = ask(
      evaluate_line(rollout.run, rollout.rollout, rollout.seed, rollout.policy, trace != nullptr),
      trace == nullptr ? kAnswerBytesMax : kTraceAnswerBytesMax);
  return read_evaluate_answer(line, task, trace);
}

}  // namespace treeroll::worker
