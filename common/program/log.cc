#include "common/program/log.h"

#include <spdlog/sinks/ansicolor_sink.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/cut_text.h"

namespace treeroll {
namespace {

using namespace std::string_view_literals;

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

using ColourSink = spdlog::sinks::ansicolor_stderr_sink_st;

/// Standard error, with a line that stays below what is logged.
class TerminalSink : public ColourSink {
 public:
  explicit TerminalSink(spdlog::color_mode mode) : ColourSink(mode) {}

  void log(const spdlog::details::log_msg& message) override {
    erase();
    ColourSink::log(message);
    draw();
  }
  void show(std::string_view text) {
    winsize size{};
    const bool is_known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    erase();
    line_ = cut_text(std::string(text), (is_known ? size.ws_col : 80U) - 1U);
    draw();
  }

 private:
  void erase() {
    if (!line_.empty()) std::fputs("\r\x1b[K", stderr);
  }
  /// The cursor waits at the begin of the line: another process that writes there, a worker, covers
  /// it.
  void draw() {
    if (!line_.empty()) std::fprintf(stderr, "%s\r", line_.c_str());
    std::fflush(stderr);
  }

  std::string line_;
};

}  // namespace

void log_to_standard_error(const std::string& name) {
  const auto sink = std::make_shared<TerminalSink>(
      is_set("NO_COLOR") ? spdlog::color_mode::never : spdlog::color_mode::automatic);
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("", sink));
  spdlog::set_pattern(name.empty() ? "%H:%M:%S.%e %^%l%$ %v"
                                   : "%Y-%m-%d %H:%M:%S.%e " + name + "[%P] %^%l%$: %v");
}

void log_line(const LogLine& line) {
  switch (line.level) {
    case LogLine::Level::kInfo:
      return spdlog::info("{}", line.text);
    case LogLine::Level::kWarning:
      return spdlog::warn("{}", line.text);
    case LogLine::Level::kError:
      return spdlog::error("{}", line.text);
  }
}

void show_status_line(std::string_view text) {
  auto* sink = dynamic_cast<TerminalSink*>(spdlog::default_logger()->sinks().front().get());
  if (sink != nullptr) sink->show(text);
}

bool has_status_line() {
  return isatty(STDERR_FILENO) == 1 && is_set("TERM") && std::getenv("TERM") != "dumb"sv;
}

void LimitedLog::add(TimePoint now, LogLine::Level level, std::string_view kind, std::string text) {
  std::vector<LogLine> lines;
  limiter_.add(now, {level, kind, std::move(text)}, lines);
  for (const LogLine& line : lines) log_line(line);
}

void LimitedLog::tell_due(TimePoint now) {
  std::vector<LogLine> lines;
  limiter_.tell_due(now, lines);
  for (const LogLine& line : lines) log_line(line);
}

}  // namespace treeroll
