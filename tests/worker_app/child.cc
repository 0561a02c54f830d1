#include "tests/worker_app/child.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "common/base/check.h"

namespace treeroll::worker {
namespace {

int nameless_file(const std::string& content) {
  const int file = memfd_create("child", MFD_CLOEXEC);
  CHECK(file >= 0, "memfd_create");
  CHECK(write(file, content.data(), content.size()) == static_cast<ssize_t>(content.size()),
        "write");
  lseek(file, 0, SEEK_SET);
  return file;
}

std::string content_of(int file) {
  std::string text(static_cast<std::size_t>(lseek(file, 0, SEEK_END)), '\0');
  const ssize_t size = pread(file, text.data(), text.size(), 0);
  text.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  return text;
}

/// State letter and parent of a process, from /proc; state 0 if there is none.
struct ProcessLine {
  char state = 0;
  pid_t parent = 0;
};

ProcessLine process_line(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  std::getline(file, line);
  const std::size_t name_end = line.rfind(')');
  if (name_end == std::string::npos) return {};
  ProcessLine found;
  std::istringstream(line.substr(name_end + 1)) >> found.state >> found.parent;
  return found;
}

}  // namespace

Child::Child(const std::vector<std::string>& arguments, const std::string& input,
             const std::string& program)
    : output_(nameless_file("")), errors_(nameless_file("")) {
  const int input_file = nameless_file(input);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input_file, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output_, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors_, STDERR_FILENO);
  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const int error =
      posix_spawn(&pid_, program.c_str(), &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(input_file);
  CHECK(error == 0, "posix_spawn");
}

Child::~Child() {
  if (!status_) {
    signal(SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  close(output_);
  close(errors_);
}

void Child::signal(int number) const {
  if (!status_) kill(pid_, number);
}

std::optional<int> Child::wait(std::chrono::milliseconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!status_ && std::chrono::steady_clock::now() < end) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      status_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  return status_;
}

std::string Child::output() const { return content_of(output_); }
std::string Child::errors() const { return content_of(errors_); }

std::vector<pid_t> children_of(pid_t parent) {
  std::vector<pid_t> children;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const pid_t pid = std::stoi(name);
    const ProcessLine line = process_line(pid);
    if (line.parent == parent && line.state != 'Z') children.push_back(pid);
  }
  return children;
}

bool is_alive(pid_t pid) {
  const char state = process_line(pid).state;
  return state != 0 && state != 'Z' && state != 'X';
}

}  // namespace treeroll::worker
