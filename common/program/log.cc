#include "common/program/log.h"

#include <fmt/format.h>
#include <spdlog/formatter.h>
#include <spdlog/sinks/ansicolor_sink.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/cut_text.h"
#include "common/program/host_name.h"

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

class JsonFormatter : public spdlog::formatter {
 public:
  JsonFormatter(std::string program, std::string host)
      : program_(std::move(program)), host_(std::move(host)) {}

  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& line) override {
    const auto since = message.time.time_since_epoch();
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(since).count();
    const std::time_t second = ms / 1000;
    std::tm utc{};
    gmtime_r(&second, &utc);
    char time[32];
    std::strftime(time, sizeof time, "%Y-%m-%dT%H:%M:%S", &utc);
    const auto level = spdlog::level::to_string_view(message.level);
    const nlohmann::ordered_json said{
        {"time", fmt::format("{}.{:03}Z", time, ms % 1000)},
        {"level", std::string(level.data(), level.size())},
        {"program", program_},
        {"host", host_},
        {"pid", getpid()},
        {"text", std::string(message.payload.data(), message.payload.size())}};
    const std::string text =
        said.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
    line.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonFormatter>(program_, host_);
  }

 private:
  std::string program_;
  std::string host_;
};

bool is_json = false;

}  // namespace

void log_as_json(const std::string& program) {
  is_json = true;
  spdlog::default_logger()->set_formatter(std::make_unique<JsonFormatter>(program, host_name()));
}

bool logs_as_json() { return is_json; }

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
  return !is_json && isatty(STDERR_FILENO) == 1 && is_set("TERM") &&
         std::getenv("TERM") != "dumb"sv;
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
