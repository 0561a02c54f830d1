#include "tests/benchmarks/peer_master.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <set>
#include <stdexcept>

namespace treeroll::benchmarks {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

/// Which roll-outs are asked for, and whether answers fit.
class Book {
 public:
  std::vector<PeerRequest> next_batch(const PeerRollouts& rollouts, int size) {
    std::vector<PeerRequest> batch;
    for (int i = 0; i < size; ++i) {
      open_.insert(open_.end(), next_);
      batch.push_back(rollouts.request(next_++));
    }
    return batch;
  }
  void take(std::span<const PeerResult> results) {
    for (const PeerResult& result : results) {
      if (open_.erase(result.number) != 1) {
        throw std::runtime_error(
            fmt::format("roll-out {}: answered without being asked for", result.number));
      }
      if (!(result.reward > 0 && result.reward <= 1)) {
        throw std::runtime_error(fmt::format("roll-out {}: reward {} is not within 0 and 1",
                                             result.number, result.reward));
      }
    }
  }
  bool empty() const { return open_.empty(); }

 private:
  std::set<std::int64_t> open_;
  std::int64_t next_ = 0;
};

}  // namespace

double processor_s(int who) {
  rusage usage{};
  getrusage(who, &usage);
  return seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
}

PeerMeasurement run_master(PeerLinks& links, const PeerRollouts& rollouts,
                           const PeerOptions& options) {
  Book book;
  PeerMeasurement measurement;
  const double before_s = processor_s(RUSAGE_SELF);
  for (int round = 0; round < options.outstanding; ++round) {
    for (int worker = 0; worker < options.workers; ++worker) {
      links.send(worker, book.next_batch(rollouts, options.batch));
    }
  }
  const Clock::time_point from = Clock::now() + std::chrono::milliseconds(options.warm_up_ms);
  const Clock::time_point to = from + std::chrono::milliseconds(options.measured_ms);
  while (!book.empty()) {
    const PeerLinks::Received received = links.receive();
    book.take(received.results);
    const Clock::time_point now = Clock::now();
    const auto number = static_cast<std::int64_t>(received.results.size());
    measurement.results_in_all += number;
    if (now >= from && now < to) measurement.results += number;
    if (now < to) links.send(received.worker, book.next_batch(rollouts, options.batch));
  }
  for (int worker = 0; worker < options.workers; ++worker) links.send(worker, {});
  measurement.measured_s = 1e-3 * options.measured_ms;
  measurement.master_cpu_s = processor_s(RUSAGE_SELF) - before_s;
  return measurement;
}

std::string to_json(const PeerMeasurement& measurement) {
  return fmt::format(
      R"({{"results": {}, "measured_s": {}, "results_in_all": {}, "master_cpu_s": {}, )"
      R"("workers_cpu_s": {}}})",
      measurement.results, measurement.measured_s, measurement.results_in_all,
      measurement.master_cpu_s, measurement.workers_cpu_s);
}

}  // namespace treeroll::benchmarks
