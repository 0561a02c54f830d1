#include "learner/journal/background_sync.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdint>

#include "common/base/check.h"

namespace treeroll {
namespace {

void tell(int event) {
  const std::uint64_t one = 1;
  CHECK(write(event, &one, sizeof one) == sizeof one, "an eventfd that takes no event");
}

void await(int event) {
  std::uint64_t count = 0;
  while (read(event, &count, sizeof count) < 0) CHECK(errno == EINTR, "an eventfd that fails");
}

int make_event() {
  const int event = eventfd(0, EFD_CLOEXEC);
  CHECK(event >= 0, "no eventfd");
  return event;
}

}  // namespace

BackgroundSync::BackgroundSync() : asked_(make_event()), done_(make_event()) {
  // Signals are for the thread that has the loop.
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { work(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

BackgroundSync::~BackgroundSync() {
  if (is_under_way_) end();
  file_ = -1;
  tell(asked_);
  thread_.join();
  close(asked_);
  close(done_);
}

void BackgroundSync::begin(int file) {
  CHECK(!is_under_way_, "two syncs at a time");
  is_under_way_ = true;
  file_ = file;
  tell(asked_);
}

int BackgroundSync::end() {
  CHECK(is_under_way_, "no sync is under way");
  await(done_);
  is_under_way_ = false;
  return error_;
}

void BackgroundSync::work() {
  for (;;) {
    await(asked_);
    const int file = file_;
    if (file < 0) return;
    error_ = fdatasync(file) == 0 ? 0 : errno;
    tell(done_);
  }
}

}  // namespace treeroll
