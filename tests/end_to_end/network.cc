#include "tests/end_to_end/network.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <utility>

namespace treeroll::end_to_end {
namespace {

struct Printed {
  int status = -1;
  std::string output;  ///< both streams
};

/// Runs a script of the shell, in another network namespace if one is given.
Printed run(const std::string& script, int network = -1) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    dup2(ends[1], STDERR_FILENO);
    if (network >= 0 && setns(network, CLONE_NEWNET) != 0) _exit(126);
    setenv("PATH", "/usr/sbin:/usr/bin:/sbin:/bin", 1);
    execl("/bin/sh", "sh", "-ec", script.c_str(), nullptr);
    _exit(127);
  }
  close(ends[1]);
  Printed said;
  std::array<char, 4096> buffer{};
  for (ssize_t size = 0; (size = read(ends[0], buffer.data(), buffer.size())) > 0;) {
    said.output.append(buffer.data(), static_cast<std::size_t>(size));
  }
  close(ends[0]);
  waitpid(child, &said.status, 0);
  return said;
}

std::string must_run(const std::string& script, int network) {
  Printed said = run(script, network);
  if (said.status != 0) throw std::runtime_error(fmt::format("{}\n{}", script, said.output));
  return std::move(said.output);
}

void write_proc(const char* path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  if (!file) throw std::runtime_error(fmt::format("{}: cannot be written", path));
}

/// Leaves the machine's network and mounts, as root or as a user that is root in here.
bool leave_machine() {
  if (unshare(CLONE_NEWNET | CLONE_NEWNS) != 0) {
    const uid_t user = geteuid();
    const gid_t group = getegid();
    if (unshare(CLONE_NEWUSER | CLONE_NEWNET | CLONE_NEWNS) != 0) return false;
    write_proc("/proc/self/setgroups", "deny");
    write_proc("/proc/self/uid_map", fmt::format("0 {} 1", user));
    write_proc("/proc/self/gid_map", fmt::format("0 {} 1", group));
  }
  return mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
}

std::optional<std::string> probe() {
  if (!leave_machine()) {
    return fmt::format("namespaces are not allowed here: {}", std::strerror(errno));
  }
  const Printed said =
      run("ip link add name probe type bridge; ip link delete probe; nft list ruleset");
  if (said.status == 0) return std::nullopt;
  return "neither bridges nor packet filters (iproute2, nftables) here: " + said.output;
}

int make_namespace() {
  const int home = open("/proc/self/ns/net", O_RDONLY | O_CLOEXEC);
  if (home < 0 || unshare(CLONE_NEWNET) != 0) throw std::runtime_error("no network namespace");
  const int made = open("/proc/self/ns/net", O_RDONLY | O_CLOEXEC);
  if (made < 0 || setns(home, CLONE_NEWNET) != 0) throw std::runtime_error("no way back");
  close(home);
  must_run("ip link set lo up", made);
  return made;
}

}  // namespace

std::optional<std::string> Network::refusal() {
  static const std::optional<std::string> reason = probe();
  return reason;
}

Network::Network(int num_hosts) : bridge_(make_namespace()) {
  must_run("ip link add name bridge type bridge mcast_snooping 0; ip link set bridge up", bridge_);
  for (int i = 0; i < num_hosts; ++i) {
    hosts_.push_back(make_namespace());
    must_run(fmt::format("ip link add name port{0} type veth peer name eth0 netns /proc/{1}/fd/{2};"
                         "ip link set port{0} master bridge up",
                         i, getpid(), hosts_.back()),
             bridge_);
    must_run(fmt::format("ip address add 10.77.0.{}/24 dev eth0; ip link set eth0 up;"
                         "ip route add 224.0.0.0/4 dev eth0",
                         i + 1),
             hosts_.back());
  }
}

Network::~Network() {
  for (const int host : hosts_) close(host);
  close(bridge_);
}

void Network::lose(int percent) {
  for (const int host : hosts_) {
    must_run(fmt::format("nft 'table netdev loss {{ }}; delete table netdev loss;"
                         "table netdev loss {{ chain in {{"
                         "  type filter hook ingress device \"eth0\" priority 0;"
                         "  numgen random mod 100 < {} counter drop; }}; }};'",
                         percent),
             host);
  }
}

std::int64_t Network::num_lost() const { return sum_of_counters("loss"); }

void Network::drop_fragments() const {
  for (const int host : hosts_) {
    must_run(
        "nft 'table netdev fragments { chain in {"
        "  type filter hook ingress device \"eth0\" priority 1;"
        "  ip frag-off & 0x3fff != 0 counter drop; }; };'",
        host);
  }
}

std::int64_t Network::num_fragments() const { return sum_of_counters("fragments"); }

void Network::send_datagram(int num_bytes) const {
  must_run(fmt::format("bash -c 'head -c {} /dev/zero > /dev/udp/10.77.0.2/9'", num_bytes),
           host(0));
}

std::int64_t Network::sum_of_counters(const std::string& table) const {
  std::int64_t sum = 0;
  for (const int host : hosts_) {
    sum += std::stoll(must_run(
        fmt::format(R"(nft list table netdev {} | sed -n 's/.*counter packets \([0-9]*\).*/\1/p')",
                    table),
        host));
  }
  return sum;
}

void Network::deafen(int index) const {
  must_run(
      "nft 'table ip deaf { chain input {"
      "  type filter hook input priority 0; iif lo accept; counter drop; }; };'",
      host(index));
}

void Network::cut(int index) const {
  must_run(fmt::format("ip link set port{} down", index), bridge_);
}

void Network::heal(int index) const {
  must_run(fmt::format("ip link set port{} up", index), bridge_);
}

SmallDisk::SmallDisk(std::string folder, int size_kib) : folder_(std::move(folder)) {
  const std::string size = fmt::format("size={}k", size_kib);
  if (mount("tmpfs", folder_.c_str(), "tmpfs", 0, size.c_str()) != 0) {
    throw std::runtime_error(fmt::format("{}: no tmpfs: {}", folder_, std::strerror(errno)));
  }
}

SmallDisk::~SmallDisk() { umount2(folder_.c_str(), MNT_DETACH); }

void SmallDisk::resize(int size_kib) const {
  const std::string size = fmt::format("size={}k", size_kib);
  if (mount(nullptr, folder_.c_str(), nullptr, MS_REMOUNT, size.c_str()) != 0) {
    throw std::runtime_error(fmt::format("{}: stays as it is: {}", folder_, std::strerror(errno)));
  }
}

}  // namespace treeroll::end_to_end
