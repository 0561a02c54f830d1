#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <optional>
#include <string>

#include "common/base/config_error.h"
#include "common/program/process_start.h"
#include "common/program/program.h"
#include "common/program/standard_output.h"
#include "common/transport/bus.h"
#include "common/transport/loop.h"
#include "learner/top/group_view.h"
#include "learner/top/screen.h"

namespace treeroll::top {
namespace {

using transport::Channel;

struct TopOptions {
  std::string lcm_url;
  std::filesystem::path key_file;
  bool once = false;
  int seconds = 3;
};

constexpr Duration kDrawPeriod = std::chrono::milliseconds(250);
/// For whom prints once: as wide as no terminal is.
constexpr std::size_t kPrintedWidth = 200;
constexpr std::size_t kPrintedHeight = 10'000;

class Top {
 public:
  explicit Top(const TopOptions& options) : options_(options) {
    transport::BusOptions bus;
    bus.url = transport::resolve_url(options.lcm_url);
    bus.channels = {Channel::kLearnerStatus, Channel::kRunStatus, Channel::kWorkerStatus};
    bus.among_programs = true;
    bus.key_file =
        transport::key_file_of("--key-file", options.key_file, transport::Voice::kLearner);
    bus.only_watches = true;
    view_.set_verified(bus.key_file.has_value());
    bus.on_message = [this](const protocol::Message& message) { view_.hear(message, loop_.now()); };
    const std::string url = bus.url;
    Result<std::unique_ptr<transport::Bus>> opened = open_bus(loop_, std::move(bus));
    if (!opened) throw ConfigError("--lcm-url", url, opened.error().message);
    bus_ = std::move(*opened);
  }

  void run() {
    loop_.on_signals(stop_signals(), [this](int) { loop_.stop(); });
    if (options_.once) return print_once();
    screen_.emplace();
    loop_.on_signals({SIGWINCH}, [this](int) {
      screen_->fit();
      draw();
    });
    loop_.watch(STDIN_FILENO, [this] { read_keys(); });
    draw();
    loop_.run();
    loop_.forget(STDIN_FILENO);
  }

 private:
  void print_once() {
    transport::Timer end(loop_, [this] { loop_.stop(); });
    end.set(loop_.now() + std::chrono::seconds(options_.seconds));
    loop_.run();
    fmt::print("{}", plain_text(view_.lines_of_all(kPrintedWidth, kPrintedHeight, loop_.now())));
    flush_standard_output();
  }

  void draw() {
    view_.forget_silent(loop_.now());
    screen_->show(view_.lines(choice_, screen_->width(), screen_->height(), loop_.now()));
    timer_.set(loop_.now() + kDrawPeriod);
  }

  void read_keys() {
    while (const std::optional<Key> key = screen_->read_key()) {
      if (*key == Key::kQuit) return loop_.stop();
      act(*key);
    }
    // A terminal that has gone is readable for ever, and has no key.
    if (screen_->is_gone()) return loop_.stop();
    draw();
  }

  void act(Key key) {
    const std::size_t num_runs = view_.num_runs(choice_, loop_.now());
    const std::size_t last = num_runs == 0 ? 0 : num_runs - 1;
    const std::size_t page = screen_->height() / 2 + 1;
    const auto back = [this](std::size_t by) { choice_.from -= std::min(choice_.from, by); };
    switch (key) {
      case Key::kUp:
        return back(1);
      case Key::kPageUp:
        return back(page);
      case Key::kDown:
        choice_.from = std::min(last, choice_.from + 1);
        return;
      case Key::kPageDown:
        choice_.from = std::min(last, choice_.from + page);
        return;
      case Key::kNextLearner:
        choice_ = {.learner = view_.next_learner(choice_, loop_.now()), .order = choice_.order};
        return;
      case Key::kNextOrder:
        choice_.order = static_cast<RunOrder>((static_cast<int>(choice_.order) + 1) % 3);
        choice_.from = 0;
        return;
      case Key::kQuit:
        return;
    }
  }

  TopOptions options_;
  transport::Loop loop_;
  GroupView view_;
  Choice choice_;
  std::unique_ptr<transport::Bus> bus_;
  std::optional<Screen> screen_;
  transport::Timer timer_{loop_, [this] { draw(); }};
};

int top_main(int argc, char** argv) {
  TopOptions options;
  const auto describe = [&](CommandLine& line) {
    line.add("--lcm-url", options.lcm_url,
             "LCM URL [LCM_DEFAULT_URL, else udpm://239.255.76.67:7667?ttl=0]");
    line.add("--key-file", options.key_file,
             "Learner's keys of treeroll-keygen: shows only what is signed with one");
    const Option once =
        line.add("--once", options.once, "Listen for a while, print all that was heard, and end");
    line.add("--seconds", options.seconds, "With --once: for so long")
        .between(1, 3600)
        .shows_default()
        .needs(once);
    line.end_help_with(
        "Keys: arrows, j, k, page keys and the space bar scroll the runs; o orders them by number, "
        "best first, worst first; Tab shows the next learner; q quits.");
  };
  return run_main(argc, argv,
                  {.name = "treeroll-top",
                   .purpose = "Shows who learns and who works on an LCM group, on a terminal.",
                   .examples = {{"treeroll-top", "who learns and who works, kept up to date"},
                                {"treeroll-top --once", "the same, printed once"}},
                   .options = describe,
                   .work = [&] {
                     Top(options).run();
                     return kExitDone;
                   }});
}

}  // namespace
}  // namespace treeroll::top

int main(int argc, char** argv) { return treeroll::top::top_main(argc, argv); }
