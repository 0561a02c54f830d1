#include "learner/web/rollout_shower.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>

#include "common/base/cut_text.h"
#include "common/program/program.h"

namespace treeroll::web {
namespace {

constexpr Duration kReapPeriod = std::chrono::milliseconds(20);
/// Who waits for a roll-out asks again and again; after this nobody does.
constexpr Duration kWantedFor = std::chrono::seconds(10);
constexpr std::size_t kFailureBytesMax = 500;

/// What the program said last on standard error, without the log's time and level.
std::string last_line(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  text.erase(0, text.rfind('\n') + 1);
  const std::size_t error = text.find(" error ");
  if (error != std::string::npos) text.erase(0, error + 7);
  return cut_text(text, kFailureBytesMax);
}

std::string end_of(int descriptor, std::size_t bytes_max) {
  struct stat facts {};
  if (fstat(descriptor, &facts) != 0) return {};
  std::string text(bytes_max, '\0');
  const ssize_t size = pread(descriptor, text.data(), text.size(),
                             std::max<off_t>(facts.st_size - static_cast<off_t>(bytes_max), 0));
  text.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  return text;
}

/// Where the user's program cannot be started, all is shown but the roll-out that it would make.
bool is_shown(int exit_status, const std::string& output) {
  return exit_status == kExitDone || (exit_status == kExitBadInput && !output.empty());
}

/// And all that it has started, below it in its group: a user's program, say.
void kill_all(pid_t child) {
  kill(-child, SIGKILL);
  kill(child, SIGKILL);  // it may not lead its group yet
}

}  // namespace

RolloutShower::RolloutShower(transport::Loop& loop, ShowingProgram program, ShowingLimits limits)
    : loop_(loop), program_(std::move(program)), limits_(limits) {}

RolloutShower::~RolloutShower() {
  if (!work_) return;
  if (work_->child.output >= 0) {
    loop_.forget(work_->child.output);
    close(work_->child.output);
  }
  close(work_->child.errors);
  kill_all(work_->child.pid);
  waitpid(work_->child.pid, nullptr, 0);
}

RolloutShower::Shown RolloutShower::show(protocol::RolloutKey key, bool is_settled) {
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) { return kept.key == key; });
  if (found != kept_.end()) {
    const bool is_final = found->is_settled && found->shown.text;
    if (is_final || loop_.now() < found->made_at + limits_.unsettled_for) {
      kept_.splice(kept_.begin(), kept_, found);
      return found->shown;
    }
  }
  if (work_ && work_->key == key) return {};
  const auto waiting = std::find_if(waiting_.begin(), waiting_.end(),
                                    [&](const Waiting& each) { return each.key == key; });
  if (waiting != waiting_.end()) {
    waiting->asked_at = loop_.now();
  } else {
    waiting_.push_back({key, is_settled, loop_.now()});
    if (waiting_.size() > limits_.waiting_max) waiting_.pop_front();
    start_next();
  }
  return {};
}

void RolloutShower::start_next() {
  while (!work_ && !waiting_.empty()) start_one();
}

void RolloutShower::start_one() {
  const auto [key, is_settled, asked_at] = waiting_.front();
  waiting_.pop_front();
  if (loop_.now() > asked_at + kWantedFor) return;
  std::vector<std::string> arguments = program_.arguments;
  arguments.push_back(fmt::format("{}:{}", key.run, key.number));
  Result<PipedChild> child = start_piped_child(program_.program, arguments, limits_.niceness);
  if (!child) {
    return keep({.key = key, .shown = {.failure = child.error().message}, .made_at = loop_.now()});
  }
  work_ = Work{.key = key, .is_settled = is_settled, .child = *child};
  loop_.watch(child->output, [this] { read(); });
  limit_timer_.set(loop_.now() + limits_.time);
}

void RolloutShower::read() {
  std::array<char, 65536> bytes;
  const ssize_t size = ::read(work_->child.output, bytes.data(), bytes.size());
  if (size > 0) {
    work_->output.append(bytes.data(), static_cast<std::size_t>(size));
    if (work_->output.size() <= limits_.output_bytes_max) return;
    work_->is_too_long = true;
    kill_all(work_->child.pid);
  }
  loop_.forget(work_->child.output);
  close(work_->child.output);
  work_->child.output = -1;
  reap();
}

void RolloutShower::give_up() {
  work_->is_too_late = true;
  kill_all(work_->child.pid);
}

/// It has closed its output; its end follows.
void RolloutShower::reap() {
  int status = 0;
  const pid_t ended = waitpid(work_->child.pid, &status, WNOHANG);
  if (ended == 0) {
    return reap_timer_.set(loop_.now() + kReapPeriod);
  }
  limit_timer_.set(TimePoint::max());
  Kept kept{.key = work_->key, .is_settled = work_->is_settled, .made_at = loop_.now()};
  if (work_->is_too_late) {
    kept.shown.failure = fmt::format("it took more than {:g} s", to_seconds(limits_.time));
  } else if (work_->is_too_long) {
    kept.shown.failure = fmt::format("it is more than {} bytes", limits_.output_bytes_max);
  } else if (ended < 0 || !WIFEXITED(status) || !is_shown(WEXITSTATUS(status), work_->output)) {
    kept.shown.failure = last_line(end_of(work_->child.errors, 65536));
    if (kept.shown.failure.empty()) {
      kept.shown.failure =
          fmt::format("{} ended with status {} (127: it cannot be executed)",
                      program_.program.string(), WIFEXITED(status) ? WEXITSTATUS(status) : -1);
    }
  } else {
    // A worker program that does not work now may do so later.
    if (work_->output.starts_with(kNotSimulated)) kept.is_settled = false;
    kept.shown.text = std::make_shared<const std::string>(std::move(work_->output));
  }
  close(work_->child.errors);
  work_.reset();
  keep(std::move(kept));
  start_next();
}

void RolloutShower::keep(Kept kept) {
  const auto bytes = [](const Kept& each) {
    return 1000 + (each.shown.text ? each.shown.text->size() : each.shown.failure.size());
  };
  std::erase_if(kept_, [&](const Kept& each) {
    if (each.key != kept.key) return false;
    kept_bytes_ -= bytes(each);
    return true;
  });
  kept_bytes_ += bytes(kept);
  kept_.push_front(std::move(kept));
  while (kept_bytes_ > limits_.cache_bytes_max && kept_.size() > 1) {
    kept_bytes_ -= bytes(kept_.back());
    kept_.pop_back();
  }
}

}  // namespace treeroll::web
