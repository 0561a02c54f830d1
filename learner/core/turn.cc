#include "learner/core/turn.h"

#include <utility>

namespace treeroll::learner {
namespace {

void write(std::vector<LogLine>& lines, Effects& effects) {
  for (LogLine& line : lines) effects.emplace_back(WriteLog{std::move(line)});
}

}  // namespace

void Turn::send(protocol::Message message) const {
  effects.emplace_back(SendMessage{std::move(message)});
}

void Turn::log(LogLine::Level level, std::string_view kind, std::string text) const {
  std::vector<LogLine> passed;
  limiter.add(now, {level, kind, std::move(text)}, passed);
  write(passed, effects);
}

void Turn::log_what_is_due() const {
  std::vector<LogLine> due;
  limiter.tell_due(now, due);
  write(due, effects);
}

void Turn::log_the_rest() const {
  std::vector<LogLine> rest;
  limiter.tell_rest(now, rest);
  write(rest, effects);
}

}  // namespace treeroll::learner
