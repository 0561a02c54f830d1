#include "common/doctor/host_checks.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/statfs.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "common/program/processor_share.h"

namespace treeroll::doctor {
namespace {

namespace fs = std::filesystem;

constexpr double kMegabyte = 1024. * 1024.;
/// Of the folder of results: a journal takes some 100 bytes a roll-out, and a full disk ends a
/// learner.
constexpr double kRoomNotice = 1024 * kMegabyte;
constexpr double kRoomTrouble = 64 * kMegabyte;
/// Past this a learner waits for its disk more than for anything else.
constexpr double kSlowSyncS = .1;
constexpr int kSyncs = 5;

struct Descriptor {
  explicit Descriptor(int value) : value(value) {}
  ~Descriptor() {
    if (value >= 0) close(value);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int value;
};

/// What flock(2) and fdatasync(2) mean there depends on its server.
bool is_on_a_network(const fs::path& folder) {
  constexpr std::array<long, 5> kKinds = {0x6969 /* nfs */, 0xff534d42 /* cifs */,
                                          0xfe534d42 /* smb2 */, 0x00c36400 /* ceph */,
                                          0x0bd00bd0 /* lustre */};
  struct statfs facts {};
  if (statfs(folder.c_str(), &facts) != 0) return false;
  return std::find(kKinds.begin(), kKinds.end(), static_cast<long>(facts.f_type)) != kKinds.end();
}

/// Seconds of each of a few writes that last; nothing, with errno, where one fails.
std::optional<std::vector<double>> time_syncs(const fs::path& folder) {
  std::string name = (folder / "treeroll-doctor.XXXXXX").string();
  const Descriptor file(mkostemp(name.data(), O_CLOEXEC));
  if (file.value < 0) return std::nullopt;
  unlink(name.c_str());
  std::vector<double> seconds;
  const std::string block(512, 'x');
  for (int i = 0; i < kSyncs; ++i) {
    const auto start = std::chrono::steady_clock::now();
    if (write(file.value, block.data(), block.size()) < 0 || fdatasync(file.value) != 0)
      return std::nullopt;
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return seconds;
}

/// The next word of a line of /proc, which is cut off it.
std::string_view next_word(std::string_view& line) {
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t end = std::min(line.find(' ', begin), line.size());
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

}  // namespace

std::optional<WayOut> way_out_to(const std::string& group, std::uint16_t port) {
  const Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  if (socket.value < 0 || inet_pton(AF_INET, group.c_str(), &address.sin_addr) != 1)
    return std::nullopt;
  socklen_t size = sizeof address;
  if (connect(socket.value, reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
      getsockname(socket.value, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    return std::nullopt;
  }
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
  WayOut way{.address = text.data(), .interface = {}, .is_loopback = false};
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) return way;
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> all(first, freeifaddrs);
  for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    if (reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr.s_addr !=
        address.sin_addr.s_addr)
      continue;
    way.interface = one->ifa_name;
    way.is_loopback = (one->ifa_flags & IFF_LOOPBACK) != 0;
  }
  return way;
}

Finding judge_route(const std::optional<WayOut>& way, const std::string& group, int ttl) {
  if (!way) {
    return {
        Level::kTrouble, "route", fmt::format("no route to {}", group),
        ttl == 0
            ? "sudo ip link set lo up multicast on && sudo ip route add 224.0.0.0/4 dev lo"
            : "sudo ip route add 224.0.0.0/4 dev INTERFACE, the one that leads to the other hosts"};
  }
  const std::string text =
      fmt::format("{} leaves by {} ({})", group,
                  way->interface.empty() ? "an unnamed interface" : way->interface, way->address);
  if (ttl == 0) return {Level::kOk, "route", text + "; ttl 0: messages stay on this host"};
  if (way->is_loopback) {
    return {
        Level::kTrouble, "route", text + ", so that no other host is reached",
        "sudo ip route replace 224.0.0.0/4 dev INTERFACE, the one that leads to the other hosts"};
  }
  return {Level::kOk, "route", fmt::format("{}; ttl {}", text, ttl)};
}

Finding judge_receive_buffer(std::int64_t granted, std::int64_t asked) {
  const std::string text =
      fmt::format("room for {:.1f} MiB of messages that wait to be read, of {:.1f} asked for",
                  static_cast<double>(granted) / kMegabyte, static_cast<double>(asked) / kMegabyte);
  if (granted >= asked) return {Level::kOk, "buffer", text};
  return {Level::kNotice, "buffer", text + ": bursts may be lost and are sent again",
          fmt::format("sudo sysctl -w net.core.rmem_max={}, and the same line in /etc/sysctl.d",
                      asked)};
}

std::int64_t lost_in_full_sockets(std::string_view snmp) {
  // A line of names and one of numbers, in the same order.
  constexpr std::string_view kName = "RcvbufErrors";
  std::string_view names;
  while (!snmp.empty()) {
    const std::size_t end = std::min(snmp.find('\n'), snmp.size());
    std::string_view line = snmp.substr(0, end);
    snmp.remove_prefix(std::min(end + 1, snmp.size()));
    if (!line.starts_with("Udp: ")) continue;
    if (names.empty()) {
      names = line;
      continue;
    }
    for (std::string_view name = next_word(names); !name.empty(); name = next_word(names)) {
      const std::string_view number = next_word(line);
      std::int64_t count = 0;
      if (name != kName) continue;
      std::from_chars(number.data(), number.data() + number.size(), count);
      return count;
    }
  }
  return 0;
}

Finding judge_drops(std::int64_t before, std::int64_t after, double seconds) {
  const char* const cure =
      "a program here reads too slowly or its buffer is too small: see `buffer`, and who takes the "
      "processor (top)";
  if (after > before) {
    return {
        Level::kTrouble, "drops",
        fmt::format("{} messages were lost on this host within {:.0f} s, as UDP sockets were full",
                    after - before, seconds),
        cure};
  }
  if (after > 0) {
    return {Level::kNotice, "drops",
            fmt::format("{} messages were lost on this host before, none within {:.0f} s", after,
                        seconds),
            cure};
  }
  return {Level::kOk, "drops", "no UDP socket on this host was ever full"};
}

Findings check_folder(const fs::path& folder) {
  Findings findings;
  const auto refuse = [&](const std::string& text, const std::string& cure) {
    findings.push_back(
        {Level::kTrouble, "disk", fmt::format("{}: {}", folder.string(), text), cure});
    return findings;
  };
  std::error_code error;
  if (!fs::is_directory(folder, error))
    return refuse("is no folder", fmt::format("mkdir -p {}", folder.string()));
  struct statvfs room {};
  if (statvfs(folder.c_str(), &room) != 0)
    return refuse(std::strerror(errno), "choose another folder (--state-dir)");
  const std::optional<std::vector<double>> syncs = time_syncs(folder);
  if (!syncs)
    return refuse(fmt::format("cannot write there: {}", std::strerror(errno)),
                  "choose another folder (--state-dir), or make room");
  const double free_bytes = static_cast<double>(room.f_bavail) * static_cast<double>(room.f_frsize);
  const std::string space =
      fmt::format("{}: {:.1f} GiB free", folder.string(), free_bytes / kMegabyte / 1024);
  const char* const more =
      "make room: a learner whose disk is full ends, and goes on with --resume";
  findings.push_back(free_bytes < kRoomTrouble  ? Finding{Level::kTrouble, "disk", space, more}
                     : free_bytes < kRoomNotice ? Finding{Level::kNotice, "disk", space, more}
                                                : Finding{Level::kOk, "disk", space});
  std::vector<double> sorted = *syncs;
  std::sort(sorted.begin(), sorted.end());
  const double median = sorted[sorted.size() / 2];
  const std::string lasting =
      fmt::format("{}: what is written lasts after {:.1f} ms", folder.string(), median * 1e3);
  findings.push_back(median > kSlowSyncS
                         ? Finding{Level::kNotice, "sync",
                                   lasting + ", and workers keep their answers so long",
                                   "keep journals on a faster disk"}
                         : Finding{Level::kOk, "sync", lasting});
  if (is_on_a_network(folder)) {
    findings.push_back({Level::kNotice, "disk",
                        fmt::format("{}: lies on another host", folder.string()),
                        "a lock there holds only as well as its server's: never start two learners "
                        "on one folder"});
  }
  return findings;
}

Finding check_clock() {
  timex state{};
  const int answer = adjtimex(&state);
  if (answer >= 0 && answer != TIME_ERROR) return {Level::kOk, "clock", "follows a time server"};
  return {Level::kNotice, "clock",
          "follows no time server: times in logs and journals of several hosts do not compare; "
          "learning does not depend on it",
          "run chrony or systemd-timesyncd"};
}

Finding check_processors() {
  return {Level::kOk, "processors",
          fmt::format("{}: so many evaluators treeroll-worker starts by itself",
                      num_usable_processors())};
}

Finding check_gnuplot() {
  const char* path = std::getenv("PATH");
  std::string_view folders = path == nullptr ? "" : path;
  while (!folders.empty()) {
    const std::size_t end = std::min(folders.find(':'), folders.size());
    const fs::path program = fs::path(folders.substr(0, end)) / "gnuplot";
    if (access(program.c_str(), X_OK) == 0) return {Level::kOk, "gnuplot", program.string()};
    folders.remove_prefix(std::min(end + 1, folders.size()));
  }
  return {Level::kNotice, "gnuplot", "is not installed: reports come without figures",
          "sudo apt-get install gnuplot-nox"};
}

}  // namespace treeroll::doctor
