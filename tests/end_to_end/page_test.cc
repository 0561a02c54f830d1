// The page of a learner and of a journal, as a person opens it: over HTTP, and in a real browser.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>

#include "tests/end_to_end/browser.h"
#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using std::chrono::seconds;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// The body of an address of this host; empty if nobody answers.
std::string fetch(int port, const std::string& path) {
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const timeval patience{.tv_sec = 20, .tv_usec = 0};
  setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::string text;
  if (connect(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) {
    const std::string request =
        "GET " + path + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    send(descriptor, request.data(), request.size(), MSG_NOSIGNAL);
    char bytes[65536];
    for (ssize_t size = 0; (size = recv(descriptor, bytes, sizeof bytes, 0)) > 0;) {
      text.append(bytes, static_cast<std::size_t>(size));
    }
  }
  close(descriptor);
  const std::size_t head = text.find("\r\n\r\n");
  return head == std::string::npos ? "" : text.substr(head + 4);
}

/// The port of the page in what a program has said; 0 while it has not.
int port_of(const std::string& log) {
  const std::string before = "the page is http://127.0.0.1:";
  const std::size_t found = log.find(before);
  return found == std::string::npos ? 0 : std::atoi(log.c_str() + found + before.size());
}

class PageTest : public testing::Test {
 protected:
  fs::path state() const { return service_.directory() / "state"; }

  std::unique_ptr<Daemon> learner(std::vector<std::string> arguments, const std::string& port) {
    arguments.insert(arguments.end(),
                     {"--lcm-url", service_.url(), "--local-workers", "2", "--http", port});
    return std::make_unique<Daemon>("treeroll-learner", arguments, service_.directory());
  }
  std::unique_ptr<Daemon> new_learner(int rollouts) {
    const fs::path study = service_.study(text_of(SwingUpStudy{.rollouts = rollouts}));
    return learner({study.string(), "--state-dir", state().string()}, "0");
  }
  static int wait_for_port(const Daemon& daemon) {
    int port = 0;
    eventually(seconds(90), [&] { return (port = port_of(daemon.standard_error())) > 0; });
    return port;
  }
  /// A roll-out step by step, once it has been made.
  static json shown(int port, const std::string& rollout) {
    json said;
    eventually(seconds(60), [&] {
      said = json::parse(fetch(port, "/api/rollouts/" + rollout), nullptr, false);
      return said.contains("condition") || said.contains("failure");
    });
    return said;
  }

  Service service_;
};

TEST_F(PageTest, ALearnerServesWhatItLearns) {
  const auto daemon = new_learner(2000);
  const int port = wait_for_port(*daemon);
  ASSERT_GT(port, 0) << daemon->standard_error();
  ASSERT_TRUE(eventually(seconds(60), [&] {
    const json state = json::parse(fetch(port, "/api/state"), nullptr, false);
    return !state.is_discarded() && state["ledger"]["applied"] > 30;
  }));
  const json rollout = shown(port, "1/3");
  ASSERT_TRUE(rollout.contains("again")) << rollout.dump();
  // It is simulated with its own seed: it gives its own reward.
  EXPECT_EQ(rollout["again"]["reward"], rollout["reward"]);
  EXPECT_EQ(rollout["again"]["trace"]["columns"][0], "time_s");
  EXPECT_FALSE(rollout["again"]["trace"]["poses"].empty());
  EXPECT_GT(rollout["again"]["terms"]["least_cost_time_s"], 0);
  EXPECT_EQ(rollout["noise"]["draws"].size(), 12U);
  EXPECT_THAT(fetch(port, "/metrics"), HasSubstr("treeroll_rollouts_applied_total{study="));
  EXPECT_EQ(fetch(port, "/healthz"), "ok\n");
  daemon->kill(SIGTERM);
  EXPECT_EQ(daemon->wait(seconds(90)), 3);
}

TEST_F(PageTest, WhoWatchesSeesTheEnd) {
  const auto daemon = new_learner(40);
  const int port = wait_for_port(*daemon);
  ASSERT_GT(port, 0);
  std::string last;
  eventually(seconds(60), [&] {
    const std::string now = fetch(port, "/api/state");
    if (!now.empty()) last = now;
    return now.empty() && !last.empty();
  });
  EXPECT_EQ(json::parse(last)["stage"], "done");
  EXPECT_EQ(daemon->wait(seconds(90)), 0) << daemon->standard_error();
}

TEST_F(PageTest, AnAddressThatOthersReachNeedsAToken) {
  const fs::path study = service_.study(text_of(SwingUpStudy{}));
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments{study.string(), "--state-dir", state().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return service_.run("treeroll-learner", arguments);
  };
  for (const auto& [arguments, word] :
       std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--http", "0.0.0.0:0"}, "needs --http-token-file"},
           {{"--http", "nonsense"}, "must be [ADDRESS:]PORT"},
           {{"--http", "203.0.113.7:80", "--http-token-file", "/dev/null"}, "must"},
           {{"--http-token-file", "x"}, "--http"}}) {
    const Said said = run(arguments);
    EXPECT_EQ(said.status, 2) << said.errors;
    EXPECT_THAT(said.errors, HasSubstr(word));
  }
  EXPECT_FALSE(fs::exists(state()));
}

/// As a link in a mail or a chat does: its site is another one than the page's.
TEST_F(PageTest, ALinkOfAnotherSiteWithTheTokenOpensThePage) {
  if (Browser::program().empty()) {
    GTEST_SKIP() << "no /usr/bin/chromium: deploy/install-packages browser";
  }
  const std::string token = "0123456789abcdef0123456789abcdef";
  const fs::path file = service_.directory() / "token";
  write_file(file, token + "\n");
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  const fs::path study = service_.study(text_of(SwingUpStudy{.rollouts = 4000}));
  const auto daemon = learner(
      {study.string(), "--state-dir", state().string(), "--http-token-file", file.string()}, "0");
  const int port = wait_for_port(*daemon);
  ASSERT_GT(port, 0) << daemon->standard_error();
  const std::string page = "://127.0.0.1:" + std::to_string(port) + "/";
  const std::string elsewhere = "http://localhost:" + std::to_string(port) + "/";
  Browser browser;
  browser.open(elsewhere);  // an answer that a token is needed is a site as well
  browser.evaluate("location.href = 'http" + page + "?token=" + token + "'");
  EXPECT_TRUE(browser.eventually(seconds(60), "study.textContent === 'swing_up'"));
  browser.open(elsewhere);
  browser.evaluate("location.href = 'http" + page + "'");
  EXPECT_TRUE(browser.eventually(seconds(60), "study.textContent === 'swing_up'"));
}

TEST_F(PageTest, AJournalIsServedAndFollowedWhileItGrows) {
  const auto daemon = new_learner(4000);
  const int port = wait_for_port(*daemon);
  ASSERT_GT(port, 0);
  const auto applied = [](int at) {
    const json state = json::parse(fetch(at, "/api/state"), nullptr, false);
    return state.is_discarded() ? -1 : state["ledger"]["applied"].get<int>();
  };
  ASSERT_TRUE(eventually(seconds(60), [&] { return applied(port) > 10; }));
  Daemon replay("treeroll-replay", {state().string(), "--http", "0"}, service_.directory());
  const int replay_port = wait_for_port(replay);
  ASSERT_GT(replay_port, 0) << replay.standard_error();
  const int before = applied(replay_port);
  EXPECT_GT(before, 0);
  EXPECT_TRUE(eventually(seconds(60), [&] { return applied(replay_port) > before + 50; }));
  daemon->kill(SIGTERM);
  EXPECT_EQ(daemon->wait(seconds(90)), 3);
  // At rest: what result files add up to.
  const Said said = service_.run("treeroll-replay", {state().string(), "--export", "jsonl"});
  const auto num_rows = std::count(said.output.begin(), said.output.end(), '\n');
  EXPECT_TRUE(eventually(seconds(90), [&] {
    const json state = json::parse(fetch(replay_port, "/api/state"), nullptr, false);
    return state["ledger"]["applied"].get<int>() + state["evaluated"].get<int>() == num_rows;
  }));
  EXPECT_TRUE(shown(replay_port, "0/-2").contains("again"));
  replay.kill(SIGINT);
  EXPECT_EQ(replay.wait(seconds(10)), 0);
}

TEST_F(PageTest, AJournalThatIsExtendedIsReadAnewAndItsRunsHaveTheirNewNumbers) {
  const auto daemon = new_learner(20);
  ASSERT_EQ(daemon->wait(seconds(90)), 0) << daemon->standard_error();
  Daemon replay("treeroll-replay", {state().string(), "--http", "0"}, service_.directory());
  const int port = wait_for_port(replay);
  ASSERT_GT(port, 0) << replay.standard_error();
  const auto study = [port] { return json::parse(fetch(port, "/api/study"), nullptr, false); };
  const int repetitions = study()["repetitions"];
  // The first run of the second condition.
  const auto second = [&](int now) { return shown(port, std::to_string(now) + "/3"); };
  const json before = second(repetitions);
  Daemon more("treeroll-learner",
              {"--resume", state().string(), "--lcm-url", service_.url(), "--local-workers", "2",
               "--set", "study.repetitions=" + std::to_string(repetitions + 1)},
              service_.directory());
  ASSERT_EQ(more.wait(seconds(90)), 0) << more.standard_error();
  ASSERT_TRUE(eventually(seconds(60), [&] {
    const json now = study();
    return !now.is_discarded() && now["repetitions"] == repetitions + 1;
  })) << replay.standard_error();
  const json after = second(repetitions + 1);
  EXPECT_EQ(after["condition"], before["condition"]);
  EXPECT_EQ(after["repetition"], 0);
  EXPECT_EQ(after["reward"], before["reward"]);
  EXPECT_TRUE(eventually(seconds(60), [&] {
    const json state = json::parse(fetch(port, "/api/state"), nullptr, false);
    return !state.is_discarded() && state["stage"] == "done" &&
           state["runs"] == 2 * (repetitions + 1);
  }));
  EXPECT_THAT(replay.standard_error(), HasSubstr("the study has been extended"));
  replay.kill(SIGINT);
  EXPECT_EQ(replay.wait(seconds(10)), 0);
}

TEST_F(PageTest, AWorkerProgramThatIsMendedShowsWhatCouldNotBeShown) {
  const auto daemon = new_learner(20);
  ASSERT_EQ(daemon->wait(seconds(90)), 0) << daemon->standard_error();
  const fs::path worker = service_.directory() / "worker";
  write_file(worker, "#!/bin/sh\nexit 1\n");
  fs::permissions(worker, fs::perms::owner_all);
  Daemon replay("treeroll-replay",
                {state().string(), "--http", "0", "--worker-program", worker.string()},
                service_.directory());
  const int port = wait_for_port(replay);
  ASSERT_GT(port, 0) << replay.standard_error();
  EXPECT_TRUE(shown(port, "0/3")["again"].contains("failure"));
  fs::remove(worker);
  fs::create_symlink(executable("treeroll-worker"), worker);
  EXPECT_TRUE(
      eventually(seconds(60), [&] { return shown(port, "0/3")["again"].contains("trace"); }));
}

/// From the bus alone; on a terminal of its own, q ends it.
TEST_F(PageTest, ATerminalShowsWhoLearnsAndWhoWorks) {
  const auto daemon = new_learner(4000);
  ASSERT_GT(wait_for_port(*daemon), 0);
  ASSERT_TRUE(eventually(seconds(60), [&] {
    const Said said =
        service_.run("treeroll-top", {"--lcm-url", service_.url(), "--once", "--seconds", "2"});
    EXPECT_EQ(said.status, 0) << said.errors;
    return said.output.find("swing_up learner on") != std::string::npos &&
           said.output.find("tree") != std::string::npos &&
           said.output.find("WORKERS 1") != std::string::npos;
  }));
  const std::string command = "(sleep 3; printf jok; sleep 1; printf q) | script -qec '" +
                              executable("treeroll-top").string() + " --lcm-url " + service_.url() +
                              "' /dev/null";
  Daemon terminal("/bin/bash", {"-c", command}, service_.directory(), {{"TERM", "xterm"}});
  EXPECT_EQ(terminal.wait(seconds(90)), 0) << terminal.standard_error();
  EXPECT_THAT(terminal.standard_output(), HasSubstr("swing_up"));
  const Said nowhere = service_.run("treeroll-top", {"--lcm-url", service_.url()});
  EXPECT_EQ(nowhere.status, 2);
  EXPECT_THAT(nowhere.errors, HasSubstr("must be a terminal"));
}

/// In Chromium: the page moves, plays, is reloaded, and finds a learner again that was killed.
TEST_F(PageTest, ABrowserShowsItAndFindsAResumedLearnerAgain) {
  if (Browser::program().empty()) {
    GTEST_SKIP() << "no /usr/bin/chromium: deploy/install-packages browser";
  }
  auto daemon = new_learner(6000);
  const int port = wait_for_port(*daemon);
  ASSERT_GT(port, 0);
  Browser browser;
  browser.resize(1300, 900);
  browser.open("http://127.0.0.1:" + std::to_string(port) + "/");
  ASSERT_TRUE(browser.eventually(seconds(60), "document.querySelector('#curves canvas')"));
  ASSERT_TRUE(browser.eventually(seconds(90), "study.textContent === 'swing_up'"));
  const std::string done = "parseInt(facts.querySelector('dd').textContent.replace(/,/g, ''))";
  const auto before = browser.evaluate(done).get<double>();
  EXPECT_TRUE(browser.eventually(seconds(60), done + " > " + std::to_string(before + 20)));
  // The best roll-out plays.
  ASSERT_TRUE(browser.eventually(seconds(60), "!motion.hidden && motion.width > 0"));
  const std::string picture = "motion.toDataURL()";
  const json still = browser.evaluate(picture);
  EXPECT_TRUE(browser.eventually(seconds(90), picture + " !== " + still.dump()));
  EXPECT_TRUE(
      browser.eventually(seconds(90), "document.querySelectorAll('#traces canvas').length > 3"));
  EXPECT_TRUE(browser.eventually(seconds(90), "document.querySelector('#policy canvas')"));
  EXPECT_EQ(browser.evaluate("runs.tBodies[0].rows.length"), 4);
  EXPECT_EQ(browser.evaluate("workers.tBodies[0].rows.length"), 1);
  // Any roll-out by a click.
  browser.evaluate("document.querySelectorAll('#rollouts tbody tr')[2].click()");
  EXPECT_TRUE(browser.eventually(
      seconds(60), "/^(tree|flat), run/.test(document.getElementById('shown-title').textContent)"));
  EXPECT_EQ(browser.evaluate("follow.checked"), false);
  // Keyboard, another theme, a narrow screen.
  browser.evaluate("theme.click()");
  browser.resize(390, 800);
  EXPECT_EQ(browser.evaluate("document.documentElement.scrollWidth <= innerWidth"), true);
  EXPECT_THAT(browser.take_errors(), IsEmpty());
  // A reload counts nothing twice.
  browser.reload();
  ASSERT_TRUE(browser.eventually(seconds(60), "document.querySelector('#curves canvas')"));
  const json served = json::parse(fetch(port, "/api/state"));
  EXPECT_LE(browser.evaluate(done).get<int>(),
            served["ledger"]["applied"].get<int>() + served["evaluated"].get<int>() + 100);
  EXPECT_THAT(browser.take_errors(), IsEmpty());
  // Killed, and resumed on the same port.
  daemon->kill(SIGKILL);
  EXPECT_TRUE(browser.eventually(seconds(90), "stage.classList.contains('gone')"));
  daemon->wait(seconds(10));
  daemon = learner({"--resume", state().string()}, std::to_string(port));
  EXPECT_TRUE(browser.eventually(seconds(60), "stage.classList.contains('learning')"));
  const auto resumed = browser.evaluate(done).get<double>();
  EXPECT_GE(resumed, before);
  EXPECT_TRUE(browser.eventually(seconds(60), done + " > " + std::to_string(resumed + 5)));
  // While nobody answered, what could not be loaded was all there was to complain of.
  for (const std::string& error : browser.take_errors()) {
    EXPECT_THAT(error, HasSubstr("Failed to load resource"));
  }
}

/// A journal at rest tells nothing new: what has failed once must be asked for all the same.
TEST_F(PageTest, WhatFailsOnceIsShownOnceItCanBe) {
  if (Browser::program().empty()) {
    GTEST_SKIP() << "no /usr/bin/chromium: deploy/install-packages browser";
  }
  const auto daemon = new_learner(20);
  ASSERT_EQ(daemon->wait(seconds(90)), 0) << daemon->standard_error();
  Daemon replay("treeroll-replay", {state().string(), "--http", "0"}, service_.directory());
  const int port = wait_for_port(replay);
  ASSERT_GT(port, 0) << replay.standard_error();
  Browser browser;
  browser.open("http://127.0.0.1:" + std::to_string(port) + "/");
  ASSERT_TRUE(browser.eventually(seconds(60), "runs.tBodies[0].rows.length > 1"));
  ASSERT_TRUE(browser.eventually(seconds(60), "rollouts.tBodies[0].rows.length > 5"));
  const std::string first = "runs.tBodies[0].rows[0].cells[0].textContent";
  const std::string title = "document.getElementById('shown-title').textContent";
  const std::string by_number = browser.evaluate(first);
  browser.evaluate("window.real = window.fetch, window.lost = 0, 0");
  browser.evaluate(
      "window.fetch = (address, more) => address.startsWith('/api/runs?') ?"
      " (++lost, Promise.reject(new Error('lost'))) : real(address, more), 0");
  // Of four runs one order begins with another one than run 0.
  const auto first_by = [port](const std::string& order) {
    const json said = json::parse(fetch(port, "/api/runs?order=" + order));
    return std::to_string(said["runs"][0]["run"].get<int>());
  };
  const std::string order = first_by("worst") == by_number ? "best" : "worst";
  browser.evaluate("document.getElementById('runs-order').value = '" + order + "', 0");
  browser.evaluate("document.getElementById('runs-order').onchange(), 0");
  ASSERT_TRUE(browser.eventually(seconds(60), "lost > 0"));
  browser.evaluate("window.fetch = real, 0");
  EXPECT_TRUE(browser.eventually(seconds(20), first + " === '" + first_by(order) + "'"));

  const std::string click = "document.querySelectorAll('#rollouts tbody tr')[2].click()";
  browser.evaluate(
      "window.fetch = (address, more) => address.startsWith('/api/rollouts/') ?"
      " Promise.resolve(new Response('{\"failure\":\"busy\"}',"
      " {headers: {'Content-Type': 'application/json'}})) : real(address, more), 0");
  browser.evaluate(click);
  ASSERT_TRUE(browser.eventually(seconds(60), title + ".endsWith('cannot be shown: busy')"));
  browser.evaluate("window.fetch = real, 0");
  browser.evaluate(click);
  EXPECT_TRUE(browser.eventually(seconds(20), "/^(tree|flat), run/.test(" + title + ")"));
}

}  // namespace
}  // namespace treeroll::end_to_end
