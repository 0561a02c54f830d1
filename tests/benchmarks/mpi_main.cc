// The same pool over MPI: rank 0 is the master, the others are its workers.

#include <fmt/format.h>
#include <mpi.h>
#include <sys/resource.h>

#include <array>
#include <stdexcept>

#include "common/program/program.h"
#include "common/program/standard_output.h"
#include "tests/benchmarks/peer_master.h"

namespace treeroll::benchmarks {
namespace {

constexpr int kTag = 1;

template <class Item>
void send_to_rank(int rank, std::span<const Item> items) {
  MPI_Send(items.data(), static_cast<int>(items.size_bytes()), MPI_BYTE, rank, kTag,
           MPI_COMM_WORLD);
}

template <class Item>
class MpiInbox {
 public:
  /// @param rank  or MPI_ANY_SOURCE; receives that of the sender
  std::span<const Item> receive(int& rank) {
    MPI_Status status;
    MPI_Recv(items_.data(), sizeof(items_), MPI_BYTE, rank, kTag, MPI_COMM_WORLD, &status);
    int bytes = 0;
    MPI_Get_count(&status, MPI_BYTE, &bytes);
    rank = status.MPI_SOURCE;
    return std::span(items_).first(static_cast<std::size_t>(bytes) / sizeof(Item));
  }

 private:
  std::array<Item, kPeerBatchMax> items_;
};

class MpiLink : public PeerLink {
 public:
  std::span<const PeerRequest> receive() override {
    int master = 0;
    return inbox_.receive(master);
  }
  void send(std::span<const PeerResult> results) override { send_to_rank(0, results); }

 private:
  MpiInbox<PeerRequest> inbox_;
};

class MpiLinks : public PeerLinks {
 public:
  void send(int worker, std::span<const PeerRequest> requests) override {
    send_to_rank(worker + 1, requests);
  }
  Received receive() override {
    int rank = MPI_ANY_SOURCE;
    const auto results = inbox_.receive(rank);
    return {rank - 1, results};
  }

 private:
  MpiInbox<PeerResult> inbox_;
};

int take_part(PeerOptions options) {
  int rank = 0;
  int size = 0;
  MPI_Init(nullptr, nullptr);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  if (size < 2) throw std::runtime_error("start it with mpirun: a master and a worker at least");
  options.workers = size - 1;
  PeerRollouts rollouts(options.study, options.overrides);
  PeerMeasurement measurement;
  const double before_s = processor_s(RUSAGE_SELF);
  if (rank == 0) {
    MpiLinks links;
    measurement = run_master(links, rollouts, options);
  } else {
    MpiLink link;
    run_peer_worker(link, rollouts);
  }
  double own_s = rank == 0 ? 0 : processor_s(RUSAGE_SELF) - before_s;
  MPI_Reduce(&own_s, &measurement.workers_cpu_s, 1, MPI_DOUBLE, MPI_SUM, 0, MPI_COMM_WORLD);
  if (rank == 0) {
    fmt::print("{}\n", to_json(measurement));
    flush_standard_output();
  }
  MPI_Finalize();
  return kExitDone;
}

int run_mpi(int argc, char** argv) {
  PeerOptions options;
  return run_main(argc, argv,
                  {.name = "benchmark-mpi",
                   .purpose = "Measures a pool of processes over MPI; mpirun says how many.",
                   .options = [&](CommandLine& line) { describe(line, options); },
                   .work = [&] { return take_part(options); }});
}

}  // namespace
}  // namespace treeroll::benchmarks

int main(int argc, char** argv) { return treeroll::benchmarks::run_mpi(argc, argv); }
