#include <fcntl.h>
#include <gmock/gmock.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <functional>
#include <string>

#include "common/transport/bus.h"
#include "tests/transport/loopback.h"

// Each test runs in a child process in a network namespace of its own, where there is no route.
namespace treeroll::transport {
namespace {

using testing::HasSubstr;

constexpr const char* kNotAllowed = "no namespace";

bool enter_empty_network() {
  return unshare(CLONE_NEWNET) == 0 || unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0;
}

bool run(const std::string& command) { return std::system(command.c_str()) == 0; }

/// What `report` returns in a child process without any network.
std::string without_network(const std::function<std::string()>& report) {
  std::array<int, 2> ends{};
  EXPECT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
  const pid_t child = fork();
  EXPECT_GE(child, 0);
  if (child == 0) {
    alarm(60);
    const std::string text = enter_empty_network() ? report() : kNotAllowed;
    const bool is_written =
        write(ends[1], text.data(), text.size()) == static_cast<ssize_t>(text.size());
    _exit(is_written ? 0 : 1);
  }
  close(ends[1]);
  std::string text;
  std::array<char, 4096> buffer{};
  for (ssize_t size = 0; (size = read(ends[0], buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(size));
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "the child ended with " << status;
  return text;
}

std::string error_of(const std::string& url) {
  Loop loop;
  const auto bus = open_bus(loop, {url, {}, {}});
  return bus ? "opened" : bus.error().message;
}

TEST(RouteTest, AMissingMulticastRouteIsNamedWithTheCommandThatAddsIt) {
  const std::string text =
      without_network([] { return error_of("udpm://239.255.76.67:7667?ttl=0"); });
  if (text == kNotAllowed) GTEST_SKIP() << "network namespaces are not allowed here";
  EXPECT_THAT(text, HasSubstr("no multicast route to 239.255.76.67"));
  EXPECT_THAT(text, HasSubstr("ip link set lo up multicast on"));
  EXPECT_THAT(text, HasSubstr("ip route add 224.0.0.0/4 dev lo"));
}

TEST(RouteTest, AcrossHostsTheRouteIsToLeadToThem) {
  const std::string text =
      without_network([] { return error_of("udpm://239.255.76.67:7667?ttl=1"); });
  if (text == kNotAllowed) GTEST_SKIP() << "network namespaces are not allowed here";
  EXPECT_THAT(text, HasSubstr("ip route add 224.0.0.0/4 dev INTERFACE"));
  EXPECT_THAT(text, testing::Not(HasSubstr("dev lo")));
}

TEST(RouteTest, TheCommandMendsItAndALostRouteIsCounted) {
  const std::string text = without_network([]() -> std::string {
    if (!run("ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo")) {
      return kNotAllowed;
    }
    Loop loop;
    Listener bus(loop, loopback_url(1), {Channel::kRunStatus});
    if (!bus.bus) return "does not open";
    bus.bus->publish(protocol::RunStatus{});
    if (!run_until(loop, [&] { return !bus.received.empty(); })) return "does not arrive";
    if (!run("ip route del 224.0.0.0/4 dev lo")) return "cannot remove the route";
    bus.bus->publish(protocol::RunStatus{});
    if (bus.bus->statistics().num_published != 1) return "counts what was not sent";
    return "mended; then " + bus.bus->statistics().last_publish_error;
  });
  if (text == kNotAllowed) GTEST_SKIP() << "network namespaces are not allowed here";
  EXPECT_THAT(text, testing::StartsWith("mended; then TREEROLL_RUNS: sending "));
  EXPECT_THAT(text, HasSubstr("Network is unreachable"));
}

}  // namespace
}  // namespace treeroll::transport
