// The units of deploy/systemd, and what schedulers start.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <regex>
#include <string>
#include <vector>

#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;

const fs::path kDeploy = fs::path(TREEROLL_SOURCE_DIR) / "deploy";

TEST(UnitsTest, ServiceManagersFindNothingWrongWithThem) {
  if (access("/usr/bin/systemd-analyze", X_OK) != 0) GTEST_SKIP() << "there is no systemd-analyze";
  const Service service;
  int num_units = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(kDeploy / "systemd")) {
    if (entry.path().extension() != ".service") continue;
    ++num_units;
    // An instance whose program is the one that was built: that it is there is checked too.
    std::string text = read_file(entry.path());
    text = std::regex_replace(text, std::regex("/usr/local/bin/"), executable("").string());
    text =
        std::regex_replace(text, std::regex("/usr/local/share/treeroll/"), kDeploy.string() + "/");
    std::string name = entry.path().filename().string();
    name.insert(name.find('@') + 1, "mine");
    write_file(service.directory() / name, text);
    const Said said = service.run("/usr/bin/systemd-analyze",
                                  {"verify", "--man=no", (service.directory() / name).string()});
    EXPECT_EQ(said.status, 0) << said.errors;
    EXPECT_EQ(said.errors.find(name), std::string::npos) << said.errors;
    // In tenths: what they may do and see.
    const Said exposure = service.run(
        "/usr/bin/systemd-analyze",
        {"security", "--offline=true", "--threshold=15", (service.directory() / name).string()});
    EXPECT_EQ(exposure.status, 0) << exposure.output;
  }
  EXPECT_EQ(num_units, 3);
}

/// What a service manager hears: a datagram socket at a path.
class Manager {
 public:
  explicit Manager(const fs::path& path) : socket_(::socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.string().copy(address.sun_path, sizeof(address.sun_path) - 1);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  }
  ~Manager() { ::close(socket_); }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  /// Takes in what has come. Whether a message that begins so was among all of them.
  bool has_heard(const std::string& beginning) {
    char text[4096];
    for (ssize_t size = 0; (size = ::recv(socket_, text, sizeof(text), MSG_DONTWAIT)) > 0;) {
      heard_.emplace_back(text, static_cast<std::size_t>(size));
    }
    return std::ranges::any_of(heard_,
                               [&](const std::string& one) { return one.starts_with(beginning); });
  }
  void forget() { heard_.clear(); }
  const std::vector<std::string>& heard() const { return heard_; }

 private:
  int socket_;
  std::vector<std::string> heard_;
};

TEST(UnitsTest, AServiceManagerIsToldWhoServesAndThatItsLoopTurns) {
  const Service service;
  const fs::path path = service.directory() / "notify";
  Manager manager(path);
  const std::map<std::string, std::string> environment = {
      {"PATH", "/usr/bin:/bin"}, {"NOTIFY_SOCKET", path.string()}, {"WATCHDOG_USEC", "3000000"}};
  Daemon worker("treeroll-worker", {"--processes", "1", "--lcm-url", service.url()},
                service.directory(), environment);
  ASSERT_TRUE(eventually(seconds(20), [&] { return manager.has_heard("READY=1"); }));
  EXPECT_TRUE(manager.heard().front().starts_with("READY=1"));  // before it nobody is to watch
  manager.forget();
  ASSERT_TRUE(eventually(seconds(20), [&] { return manager.has_heard("WATCHDOG=1"); }));
  worker.kill(SIGSTOP);  // hangs, that is
  ASSERT_FALSE(eventually(seconds(1), [] { return false; }));
  manager.has_heard("");
  manager.forget();
  ASSERT_FALSE(eventually(seconds(3), [&] { return manager.has_heard("WATCHDOG=1"); }));
  worker.kill(SIGCONT);
  ASSERT_TRUE(eventually(seconds(20), [&] { return manager.has_heard("WATCHDOG=1"); }));

  const fs::path study =
      service.study(text_of(SyntheticStudy{"name = \"synthetic\"\nrepetitions = 2\nrollouts = 60",
                                           "duration_us = 20000\nmode = \"sleep\""}));
  manager.forget();
  Daemon learner("treeroll-learner",
                 {study.string(), "--lcm-url", service.url(), "--state-dir",
                  (service.directory() / "state").string()},
                 service.directory(), environment);
  // Before it writes its results.
  EXPECT_TRUE(
      eventually(seconds(60), [&] { return manager.has_heard("WATCHDOG_USEC=3600000000"); }));
  EXPECT_EQ(learner.wait(seconds(60)), 0) << learner.standard_error();
  EXPECT_TRUE(manager.has_heard("READY=1"));
  EXPECT_TRUE(manager.has_heard("STATUS=0 of "));
  // Started again, it has nothing to do, which is no failure to start.
  manager.forget();
  Daemon again("treeroll-learner",
               {"--resume", (service.directory() / "state").string(), "--lcm-url", service.url()},
               service.directory(), environment);
  EXPECT_EQ(again.wait(seconds(60)), 0) << again.standard_error();
  EXPECT_TRUE(manager.has_heard("READY=1"));
  worker.kill(SIGTERM);
  EXPECT_EQ(worker.wait(seconds(20)), 0) << worker.standard_error();
  EXPECT_TRUE(manager.has_heard("STOPPING=1"));
}

TEST(UnitsTest, WhoOnlyInheritsTheManagersAddressIsSilent) {
  const Service service;
  const fs::path path = service.directory() / "notify";
  Manager manager(path);
  Daemon worker("treeroll-worker",
                {"--processes", "1", "--lcm-url", service.url(), "--exit-when-idle", "1"},
                service.directory(),
                {{"PATH", "/usr/bin:/bin"},
                 {"NOTIFY_SOCKET", path.string()},
                 {"WATCHDOG_USEC", "300000"},
                 {"WATCHDOG_PID", "1"}});
  EXPECT_EQ(worker.wait(seconds(30)), 0) << worker.standard_error();
  EXPECT_FALSE(manager.has_heard(""));
}

TEST(LearnOrResumeTest, GoesOnWhereAStudyWasStopped) {
  const Service service;
  const fs::path study =
      service.study(text_of(SyntheticStudy{"name = \"synthetic\"\nrepetitions = 4\nrollouts = 40",
                                           "duration_us = 20000\nmode = \"sleep\""}));
  const std::string state = (service.directory() / "state").string();
  const std::map<std::string, std::string> environment = {
      {"PATH", executable("").string() + ":/usr/bin:/bin"}, {"LCM_DEFAULT_URL", service.url()}};
  const std::vector<std::string> arguments{study.string(), state, "--local-workers", "2"};
  const std::string program = (kDeploy / "learn-or-resume").string();
  Daemon first(program, arguments, service.directory(), environment);
  ASSERT_TRUE(eventually(seconds(30), [&] {
    std::error_code none_yet;
    return fs::file_size(fs::path(state) / "journal.lcmlog", none_yet) > 3000 && !none_yet;
  })) << first.standard_error();
  first.kill(SIGTERM);
  EXPECT_EQ(first.wait(seconds(30)), 3) << first.standard_error();
  Daemon second(program, arguments, service.directory(), environment);
  EXPECT_EQ(second.wait(seconds(60)), 0) << second.standard_error();
  EXPECT_THAT(second.standard_error(), HasSubstr("goes on in"));
}

TEST(WorkerIdleTest, EndsByItselfWithoutWork) {
  const Service service;
  Daemon worker("treeroll-worker",
                {"--processes", "1", "--lcm-url", service.url(), "--exit-when-idle", "1"},
                service.directory());
  EXPECT_EQ(worker.wait(seconds(30)), 0) << worker.standard_error();
  EXPECT_THAT(worker.standard_error(), HasSubstr("had nothing to do for 1 s"));
  const Said said = service.run("treeroll-worker", {"--exit-when-idle", "0"});
  EXPECT_EQ(said.status, 2);
  EXPECT_THAT(said.errors, HasSubstr("--exit-when-idle"));
}

}  // namespace
}  // namespace treeroll::end_to_end
