#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace treeroll::worker {

/// A process of the real treeroll-worker, or of another program. Ended with the object, whatever
/// became of it.
class Child {
 public:
  /// @param input  its standard input
  explicit Child(const std::vector<std::string>& arguments, const std::string& input = "",
                 const std::string& program = TREEROLL_WORKER_PROGRAM);
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  pid_t pid() const { return pid_; }
  void signal(int number) const;
  /// Its exit status, or minus the signal that ended it; empty if it still runs at the limit.
  std::optional<int> wait(std::chrono::milliseconds limit = std::chrono::seconds(20));
  /// What it has written so far.
  std::string output() const;
  std::string errors() const;

 private:
  pid_t pid_ = -1;
  int output_ = -1;  // files without a name, so that no pipe can fill
  int errors_ = -1;
  std::optional<int> status_;
};

/// Living processes whose parent is `parent`.
std::vector<pid_t> children_of(pid_t parent);
/// Whether the process runs: neither gone nor a zombie.
bool is_alive(pid_t pid);

}  // namespace treeroll::worker
