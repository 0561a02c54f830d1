#include "tests/end_to_end/service.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <sstream>
#include <thread>

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

std::atomic<int> next_number{0};

constexpr const char* kTreeAndFlat = R"(
[[conditions]]
name = "tree"
policy.model = "tree"
[[conditions]]
name = "flat"
policy.model = "flat"
)";

}  // namespace

fs::path executable(const std::string& name) {
  return fs::read_symlink("/proc/self/exe").parent_path() / name;
}

std::string read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

int count_of(const std::string& text, const std::string& words) {
  int count = 0;
  for (auto at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++count;
  return count;
}

void write_file(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

Daemon::Daemon(const std::string& name, const std::vector<std::string>& arguments,
               const fs::path& directory, const std::map<std::string, std::string>& environment,
               int network)
    : output_(directory / fmt::format("daemon-{}", next_number++)) {
  const fs::path program = name.find('/') == std::string::npos ? executable(name) : fs::path(name);
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const std::string out = output_.string() + ".out";
  const std::string err = output_.string() + ".err";
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600), STDOUT_FILENO);
    dup2(open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600), STDERR_FILENO);
    if (network >= 0 && setns(network, CLONE_NEWNET) != 0) _exit(126);
    for (const auto& [key, value] : environment) setenv(key.c_str(), value.c_str(), 1);
    execv(argv[0], argv.data());
    _exit(127);
  }
}

Daemon::~Daemon() {
  if (ended_ || pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

void Daemon::kill(int signal) const { ::kill(pid_, signal); }

int Daemon::wait(std::chrono::seconds limit) {
  int status = 0;
  const bool over = eventually(limit, [&] { return waitpid(pid_, &status, WNOHANG) == pid_; });
  if (!over) return -1;
  ended_ = true;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string Daemon::standard_output() const { return read_file(output_.string() + ".out"); }
std::string Daemon::standard_error() const { return read_file(output_.string() + ".err"); }

std::vector<pid_t> Daemon::children() const {
  std::istringstream list(read_file(fmt::format("/proc/{0}/task/{0}/children", pid_)));
  std::vector<pid_t> pids;
  for (pid_t pid = 0; list >> pid;) pids.push_back(pid);
  return pids;
}

Service::Service() {
  const int number = static_cast<int>(getpid() % 20000) + next_number++ * 20011;
  url_ = fmt::format("udpm://239.255.{}.{}:{}?ttl=0", 80 + number % 100, 1 + number % 250,
                     20000 + number % 30000);
}

Said Service::run(const std::string& program, const std::vector<std::string>& arguments) const {
  Daemon process(program, arguments, directory_);
  const int status = process.wait(std::chrono::seconds(60));
  return {status, process.standard_output(), process.standard_error()};
}

fs::path Service::study(const std::string& text) const {
  const fs::path path = directory_ / fmt::format("study-{}.toml", next_number++);
  write_file(path, text);
  return path;
}

Service::Learnt Service::learn(const fs::path& study, std::vector<std::string> arguments) const {
  const std::string name = fmt::format("state-{}", next_number++);
  arguments.insert(arguments.begin(), {study.string(), "--json", "--lcm-url", url_, "--state-dir",
                                       (directory_ / name).string()});
  Daemon learner("treeroll-learner", arguments, directory_);
  return learnt(learner, name, std::chrono::seconds(100));
}

Service::Learnt Service::learnt(Daemon& learner, const std::string& name,
                                std::chrono::seconds limit) const {
  Learnt learnt;
  learnt.status = learner.wait(limit);
  learnt.log = learner.standard_error();
  learnt.summary = nlohmann::json::parse(learner.standard_output(), nullptr, false);
  learnt.rollouts_csv = read_file(directory_ / name / "rollouts.csv");
  learnt.runs_csv = read_file(directory_ / name / "runs.csv");
  return learnt;
}

bool eventually(std::chrono::seconds limit, const std::function<bool()>& condition) {
  const Clock::time_point deadline = Clock::now() + limit;
  while (!condition()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

std::string text_of(const SwingUpStudy& study) {
  return fmt::format(R"(
[study]
name = "swing_up"
seed = {}
repetitions = {}
rollouts = {}
in_flight = {}
order = "sequence"
[task]
name = "swing_up"
plant = "ode"
[policy]
components = [2, 4]
[exploration]
noise_variance = [0.01, 0.3, 0.02]
initial_noise_factor = 0.03
convergence_window = 10
{})",
                     study.seed, study.repetitions, study.rollouts, study.in_flight, kTreeAndFlat);
}

std::string text_of(const SyntheticStudy& study) {
  return fmt::format(R"(
[study]
{}
[task]
name = "synthetic"
{}
[policy]
components = [2, 4]
[exploration]
noise_variance = [0.01, 0.1, 0.01]
convergence_window = 10
{})",
                     study.study, study.task, kTreeAndFlat);
}

std::string reach_study(const std::string& lines) {
  return fmt::format(R"([study]
{}

[task]
name = "reach"
goal_m = 0.7

[policy]
start = "components"
layout = "means"
[policy.layer_1]
range = [0.0, 2.0]
outputs = [0.0]
deviations = [0.5, 0.3]

[exploration]
noise_variance = [0.01, 1.0]
initial_noise_factor = 0.1
minimum_noise_fraction = 0.01

[[conditions]]
name = "flat"
policy.model = "flat"
)",
                     lines);
}

}  // namespace treeroll::end_to_end
