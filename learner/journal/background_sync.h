#pragma once

#include <atomic>
#include <thread>

namespace treeroll {

/// fdatasync(2) in a thread of its own: a disk may take ten milliseconds, in which a learner's
/// evaluators would run dry. The thread touches nothing but the file. One user, one thread.
class BackgroundSync {
 public:
  BackgroundSync();
  /// Waits for what is under way.
  ~BackgroundSync();
  BackgroundSync(const BackgroundSync&) = delete;
  BackgroundSync& operator=(const BackgroundSync&) = delete;

  /// Precondition: none is under way. The file stays open until end() has returned.
  void begin(int file);
  bool is_under_way() const { return is_under_way_; }
  /// A descriptor that is readable from when the sync is done until end() has returned.
  int done() const { return done_; }
  /// Waits for it. @return 0, or errno of a sync that has failed
  /// Precondition: one is under way.
  int end();

 private:
  void work();

  int asked_;  // eventfd(2), both
  int done_;
  bool is_under_way_ = false;
  std::atomic<int> file_ = -1;  // -1: the thread is to end
  std::atomic<int> error_ = 0;
  std::thread thread_;
};

}  // namespace treeroll
