// Mutants of what a learner and a worker say to each other, sent to both while they work: they live
// on and do not grow, and with keys nothing of it is taken. TREEROLL_DATAGRAMS: how many.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <thread>

#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::int64_t kDatagramsOfFlood = 1'000'000;
constexpr std::size_t kOverheardMax = 400;
constexpr int kBurst = 128;

std::int64_t num_datagrams() {
  const char* asked = std::getenv("TREEROLL_DATAGRAMS");
  return asked == nullptr ? kDatagramsOfFlood : std::atoll(asked);
}

/// Somebody on the group of this host.
class Bystander {
 public:
  explicit Bystander(const std::string& url) {
    int port = 0;
    std::array<char, 32> group{};
    EXPECT_EQ(std::sscanf(url.c_str(), "udpm://%31[0-9.]:%d", group.data(), &port), 2);
    address_.sin_family = AF_INET;
    address_.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, group.data(), &address_.sin_addr);
    socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const int yes = 1;
    setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address_), sizeof address_), 0);
    const ip_mreq membership{.imr_multiaddr = address_.sin_addr, .imr_interface = {INADDR_ANY}};
    EXPECT_EQ(setsockopt(socket_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership),
              0);
    const unsigned char ttl = 0;
    setsockopt(socket_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
    port_ = port;
  }
  ~Bystander() { close(socket_); }
  Bystander(const Bystander&) = delete;
  Bystander& operator=(const Bystander&) = delete;

  /// What has been said lately, as it came.
  std::vector<std::string> overhear(std::size_t count) const {
    std::vector<std::string> heard;
    std::string buffer(65'536, '\0');
    eventually(seconds(20), [&] {
      ssize_t size = 0;
      while (heard.size() < count && (size = recv(socket_, buffer.data(), buffer.size(), 0)) > 0) {
        heard.push_back(buffer.substr(0, static_cast<std::size_t>(size)));
      }
      return heard.size() >= count;
    });
    return heard;
  }
  void say(const std::string& bytes) const {
    sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&address_),
           sizeof address_);
  }
  /// Datagrams that the kernel has dropped since the sockets were opened, all receivers together
  /// but for this one, which reads nothing.
  std::int64_t num_dropped() const {
    std::ifstream table("/proc/net/udp");
    std::int64_t sum = 0;
    std::ostringstream place;
    place << ':' << std::hex << std::uppercase << port_;
    for (std::string line; std::getline(table, line);) {
      std::istringstream words(line);
      std::vector<std::string> fields;
      for (std::string word; words >> word;) fields.push_back(word);
      if (fields.size() < 13 || !fields[1].ends_with(place.str())) continue;
      if (std::stoul(fields[9]) == inode()) continue;
      sum += std::atoll(fields.back().c_str());
    }
    return sum;
  }

 private:
  unsigned long inode() const {
    std::array<char, 64> link{};
    const std::string path = "/proc/self/fd/" + std::to_string(socket_);
    const ssize_t size = readlink(path.c_str(), link.data(), link.size() - 1);
    unsigned long number = 0;
    if (size > 0) std::sscanf(link.data(), "socket:[%lu]", &number);
    return number;
  }

  sockaddr_in address_{};
  int socket_ = -1;
  int port_ = 0;
};

std::string mutant(const std::vector<std::string>& heard, std::mt19937_64& random) {
  const auto below = [&random](std::size_t bound) {
    return random() % std::max<std::size_t>(bound, 1);
  };
  std::string made = heard[below(heard.size())];
  if (below(10) == 0) {
    made.resize(std::min<std::size_t>(made.size(), 8 + below(60)));
    for (std::size_t size = below(200); size > 0; --size) made += static_cast<char>(random());
    return made;
  }
  if (below(10) == 0) made.resize(below(made.size() + 1));
  for (std::size_t count = below(5); count > 0 && !made.empty(); --count) {
    const std::size_t place = below(made.size());
    if (below(2) == 0) {
      made[place] = static_cast<char>(made[place] ^ static_cast<char>(1U << below(8)));
    } else {
      made[place] = static_cast<char>(random());
    }
  }
  return made;
}

long resident_kb(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string word; status >> word;) {
    if (long kb = 0; word == "VmRSS:" && status >> kb) return kb;
  }
  return 0;
}

class FloodTest : public ::testing::TestWithParam<bool> {
 protected:
  std::string key(const std::string& name) const { return (service_.directory() / name).string(); }
  std::vector<std::string> with_key(std::vector<std::string> arguments,
                                    const std::string& name) const {
    if (GetParam()) arguments.insert(arguments.end(), {"--key-file", key(name)});
    return arguments;
  }

  const Service service_;
};

INSTANTIATE_TEST_SUITE_P(Keys, FloodTest, ::testing::Bool(), [](const auto& with) {
  return with.param ? std::string("WithKeys") : std::string("WithoutKeys");
});

TEST_P(FloodTest, LearnerAndWorkerLiveOnAndDoNotGrow) {
  if (GetParam()) {
    ASSERT_EQ(service_.run("treeroll-keygen", {key("learner.key")}).status, 0);
    ASSERT_EQ(
        service_.run("treeroll-keygen", {key("worker.key"), "--worker-of", key("learner.key")})
            .status,
        0);
  }
  const std::string study =
      service_
          .study(text_of(
              SyntheticStudy{.study = "name = \"flood\"\nrepetitions = 2\nrollouts = 1000000\n",
                             .task = "mode = \"sleep\"\nduration_us = 20000\n"}))
          .string();
  const std::string state = (service_.directory() / "state").string();
  const Bystander bystander(service_.url());
  Daemon worker("treeroll-worker",
                with_key({"--processes", "1", "--lcm-url", service_.url()}, "worker.key"),
                service_.directory());
  Daemon learner(
      "treeroll-learner",
      with_key({study, "--json", "--state-dir", state, "--lcm-url", service_.url()}, "learner.key"),
      service_.directory());
  const std::vector<std::string> heard = bystander.overhear(kOverheardMax);
  ASSERT_EQ(heard.size(), kOverheardMax) << learner.standard_error();

  std::mt19937_64 random(3);
  const std::int64_t count = num_datagrams();
  const std::int64_t dropped_before = bystander.num_dropped();
  std::int64_t dropped = dropped_before;
  long learner_kb = 0;
  long worker_kb = 0;
  std::uintmax_t bytes_at_half = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    bystander.say(mutant(heard, random));
    if (i == count / 5) {
      learner_kb = resident_kb(learner.pid());
      worker_kb = resident_kb(worker.pid());
    }
    if (i == count / 2)
      bytes_at_half = std::filesystem::file_size(std::filesystem::path(state) / "journal.lcmlog");
    if (i % kBurst != 0) continue;
    // What is dropped has tried nobody: as fast as they read.
    std::this_thread::sleep_for(milliseconds(1));
    if (const std::int64_t now = bystander.num_dropped(); now > dropped) {
      dropped = now;
      std::this_thread::sleep_for(milliseconds(20));
    }
  }
  std::printf(
      "  %lld datagrams, %lld of them dropped by a receiver's socket; resident kB: learner "
      "%ld, then %ld; worker %ld, then %ld\n",
      static_cast<long long>(count), static_cast<long long>(dropped - dropped_before), learner_kb,
      resident_kb(learner.pid()), worker_kb, resident_kb(worker.pid()));
  // Roll-outs of a study that goes on take 16 bytes each, reserved; names fill bounded tables.
  constexpr long kGrowthKb = 48 * 1024;
  EXPECT_LT(resident_kb(learner.pid()) - learner_kb, kGrowthKb);
  EXPECT_LT(resident_kb(worker.pid()) - worker_kb, kGrowthKb);
  EXPECT_LT(dropped - dropped_before, count / 2) << "else nobody was tried";

  learner.kill(SIGTERM);
  const Service::Learnt learnt = service_.learnt(learner, "state", seconds(60));
  EXPECT_EQ(learnt.status, 3) << learnt.log;
  worker.kill(SIGTERM);
  EXPECT_EQ(worker.wait(seconds(30)), 0) << worker.standard_error();
  EXPECT_THAT(learnt.log, HasSubstr("datagrams refused so far"));
  const Said verified = service_.run("treeroll-replay", {state, "--verify"});
  EXPECT_EQ(verified.status, 0) << verified.errors;
  if (!GetParam()) return;
  EXPECT_GT(std::filesystem::file_size(std::filesystem::path(state) / "journal.lcmlog"),
            bytes_at_half)
      << "nothing was learnt under the flood";
  EXPECT_EQ(learnt.summary["workers"].size(), 1U) << learnt.summary["workers"];
  for (const char* refused : {"rejected", "unasked", "conflicting"}) {
    EXPECT_EQ(learnt.summary["ledger"][refused], 0) << refused;
  }
  EXPECT_THAT(learnt.log, Not(HasSubstr("worker 0 ")));
}

}  // namespace
}  // namespace treeroll::end_to_end
