// A pool as one writes it by hand: a master and the workers it forks, over socketpairs. With
// --alone the workers execute without a master: what the machine can do at most.

#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>

#include "common/program/program.h"
#include "common/program/standard_output.h"
#include "tests/benchmarks/peer_master.h"

namespace treeroll::benchmarks {
namespace {

[[noreturn]] void fail(const char* action) {
  throw std::runtime_error(fmt::format("{}: {}", action, strerror(errno)));
}

/// One packet each way; a packet of no bytes cannot be told from the end, so the end is the end.
template <class Item>
void send_items(int socket, std::span<const Item> items) {
  if (::send(socket, items.data(), items.size_bytes(), MSG_NOSIGNAL) < 0) fail("send");
}

template <class Item>
class Inbox {
 public:
  std::span<const Item> receive(int socket) {
    const ssize_t bytes = recv(socket, items_.data(), sizeof(items_), 0);
    if (bytes < 0) fail("recv");
    return std::span(items_).first(static_cast<std::size_t>(bytes) / sizeof(Item));
  }

 private:
  std::array<Item, kPeerBatchMax> items_;
};

class SocketLink : public PeerLink {
 public:
  explicit SocketLink(int socket) : socket_(socket) {}
  std::span<const PeerRequest> receive() override { return inbox_.receive(socket_); }
  void send(std::span<const PeerResult> results) override { send_items(socket_, results); }

 private:
  int socket_;
  Inbox<PeerRequest> inbox_;
};

class SocketLinks : public PeerLinks {
 public:
  explicit SocketLinks(const std::vector<int>& sockets) {
    for (const int socket : sockets) polled_.push_back({socket, POLLIN, 0});
  }

  void send(int worker, std::span<const PeerRequest> requests) override {
    const int socket = polled_[static_cast<std::size_t>(worker)].fd;
    requests.empty() ? (void)shutdown(socket, SHUT_WR) : send_items(socket, requests);
  }

  Received receive() override {
    for (;;) {
      for (; next_ < polled_.size(); ++next_) {
        if (polled_[next_].revents == 0) continue;
        const auto worker = static_cast<int>(next_++);
        const auto results = inbox_.receive(polled_[next_ - 1].fd);
        if (results.empty()) throw std::runtime_error("a worker has ended before its time");
        return {worker, results};
      }
      if (poll(polled_.data(), polled_.size(), -1) < 0 && errno != EINTR) fail("poll");
      next_ = 0;
    }
  }

 private:
  std::vector<pollfd> polled_;
  std::size_t next_ = SIZE_MAX;
  Inbox<PeerResult> inbox_;
};

/// Forks a child that does `work` with its end of a socketpair, and ends.
template <class Work>
int start_child(const Work& work) {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) fail("socketpair");
  const pid_t master = getpid();
  const pid_t child = fork();
  if (child < 0) fail("fork");
  if (child > 0) {
    close(ends[1]);
    return ends[0];
  }
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  close(ends[0]);
  int status = kExitOther;
  try {
    if (getppid() == master) work(ends[1]);
    status = kExitDone;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
  }
  _exit(status);
}

void wait_for_children() {
  for (int status = 0; wait(&status) > 0;) {
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
      throw std::runtime_error("a worker has failed");
    }
  }
}

PeerMeasurement measure_pool(const PeerOptions& options, PeerRollouts& rollouts) {
  std::vector<int> sockets;
  for (int i = 0; i < options.workers; ++i) {
    sockets.push_back(start_child([&](int socket) {
      // Those of the workers before: each is to see the end of its own.
      for (const int other : sockets) close(other);
      SocketLink link(socket);
      run_peer_worker(link, rollouts);
    }));
  }
  SocketLinks links(sockets);
  return run_master(links, rollouts, options);
}

PeerMeasurement measure_alone(const PeerOptions& options, PeerRollouts& rollouts) {
  const auto from =
      std::chrono::steady_clock::now() + std::chrono::milliseconds(options.warm_up_ms);
  const auto to = from + std::chrono::milliseconds(options.measured_ms);
  std::vector<int> sockets;
  for (int i = 0; i < options.workers; ++i) {
    sockets.push_back(start_child([&](int socket) {
      const LoneCount count = run_alone(rollouts, from, to);
      send_items(socket, std::span(&count, 1));
    }));
  }
  PeerMeasurement measurement;
  measurement.measured_s = 1e-3 * options.measured_ms;
  Inbox<LoneCount> inbox;
  for (const int socket : sockets) {
    const auto counts = inbox.receive(socket);
    if (counts.empty()) throw std::runtime_error("a worker has ended before its time");
    measurement.results += counts.front().measured;
    measurement.results_in_all += counts.front().in_all;
  }
  return measurement;
}

int run_pool(int argc, char** argv) {
  PeerOptions options;
  bool alone = false;
  return run_main(argc, argv,
                  {.name = "benchmark-pool",
                   .purpose = "Measures a pool of processes over socketpairs.",
                   .options =
                       [&](CommandLine& line) {
                         describe(line, options);
                         line.add("--alone", alone, "No master: each worker for itself");
                       },
                   .work =
                       [&] {
                         PeerRollouts rollouts(options.study, options.overrides);
                         PeerMeasurement measurement = alone ? measure_alone(options, rollouts)
                                                             : measure_pool(options, rollouts);
                         wait_for_children();
                         measurement.workers_cpu_s = processor_s(RUSAGE_CHILDREN);
                         fmt::print("{}\n", to_json(measurement));
                         flush_standard_output();
                         return kExitDone;
                       }});
}

}  // namespace
}  // namespace treeroll::benchmarks

int main(int argc, char** argv) { return treeroll::benchmarks::run_pool(argc, argv); }
