#include "tests/end_to_end/browser.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <thread>

namespace treeroll::end_to_end {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kPatience{60};
// Where Chromium looks for the pipe's ends.
constexpr int kItReads = 3;
constexpr int kItWrites = 4;

}  // namespace

std::filesystem::path Browser::program() {
  for (const char* path : {"/usr/bin/chromium", "/usr/bin/chromium-browser"}) {
    if (access(path, X_OK) == 0) return path;
  }
  return {};
}

Browser::Browser() {
  int there[2];
  int back[2];
  if (pipe2(there, O_CLOEXEC) != 0 || pipe2(back, O_CLOEXEC) != 0) {
    throw std::runtime_error("cannot make a pipe");
  }
  const std::vector<std::string> words = {program().string(),
                                          "--headless=new",
                                          "--remote-debugging-pipe",
                                          "--no-sandbox",
                                          "--disable-gpu",
                                          "--disable-dev-shm-usage",
                                          "--no-first-run",
                                          "--disable-extensions",
                                          "--disable-background-networking",
                                          "--disable-component-update",
                                          "--user-data-dir=" + profile_.path().string(),
                                          "about:blank"};
  std::vector<char*> argv;
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    setpgid(0, 0);
    // Out of the way first: an end may have the number of another.
    const int reads = fcntl(there[0], F_DUPFD, 10);
    const int writes = fcntl(back[1], F_DUPFD, 10);
    const int nowhere = ::open("/dev/null", O_RDWR);
    for (const int descriptor : {0, 1, 2}) dup2(nowhere, descriptor);
    dup2(reads, kItReads);
    dup2(writes, kItWrites);
    close_range(kItWrites + 1, ~0U, 0);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(there[0]);
  close(back[1]);
  to_ = there[1];
  from_ = back[0];
  const json target = call("Target.createTarget", {{"url", "about:blank"}});
  const json attached =
      call("Target.attachToTarget", {{"targetId", target["targetId"]}, {"flatten", true}});
  session_ = attached["sessionId"];
  call("Runtime.enable");
  call("Log.enable");
  call("Page.enable");
}

Browser::~Browser() {
  close(to_);
  close(from_);
  if (pid_ <= 0) return;
  kill(-pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // they still write to the profile
}

void Browser::open(const std::string& url) { call("Page.navigate", {{"url", url}}); }

void Browser::reload() { call("Page.reload"); }

void Browser::resize(int width, int height) {
  call("Emulation.setDeviceMetricsOverride",
       {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", false}});
}

json Browser::evaluate(const std::string& expression) {
  const json said =
      call("Runtime.evaluate",
           {{"expression", expression}, {"returnByValue", true}, {"awaitPromise", true}});
  if (said.contains("exceptionDetails")) {
    throw std::runtime_error(expression + ": " + said["exceptionDetails"].dump());
  }
  return said["result"].value("value", json());
}

bool Browser::eventually(std::chrono::seconds limit, const std::string& expression) {
  const Clock::time_point deadline = Clock::now() + limit;
  const std::string question =
      "(() => { try { return Boolean(" + expression + "); } catch { return false; } })()";
  while (evaluate(question) != true) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return true;
}

std::vector<std::string> Browser::take_errors() {
  evaluate("0");  // what was said before has come
  return std::exchange(errors_, {});
}

json Browser::call(const std::string& method, const json& parameters) {
  json message{{"id", ++last_id_}, {"method", method}};
  if (!parameters.is_null()) message["params"] = parameters;
  if (!session_.empty()) message["sessionId"] = session_;
  std::string text = message.dump();
  text += '\0';
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t size = write(to_, text.data() + sent, text.size() - sent);
    if (size <= 0) throw std::runtime_error("the browser has ended");
    sent += static_cast<std::size_t>(size);
  }
  for (;;) {
    const json said = next_message();
    if (said.value("id", 0) == last_id_) {
      if (said.contains("error")) throw std::runtime_error(method + ": " + said["error"].dump());
      return said["result"];
    }
    note(said);
  }
}

json Browser::next_message() {
  const Clock::time_point deadline = Clock::now() + kPatience;
  for (;;) {
    const std::size_t end = input_.find('\0');
    if (end != std::string::npos) {
      const json message = json::parse(input_.substr(0, end));
      input_.erase(0, end + 1);
      return message;
    }
    pollfd ready{from_, POLLIN, 0};
    if (Clock::now() > deadline) throw std::runtime_error("the browser does not answer");
    if (poll(&ready, 1, 1000) <= 0) continue;
    char bytes[65536];
    const ssize_t size = read(from_, bytes, sizeof bytes);
    if (size <= 0) throw std::runtime_error("the browser has ended");
    input_.append(bytes, static_cast<std::size_t>(size));
  }
}

void Browser::note(const json& event) {
  const std::string method = event.value("method", "");
  const json parameters = event.value("params", json::object());
  if (method == "Runtime.exceptionThrown") errors_.push_back(parameters.dump());
  if (method == "Runtime.consoleAPICalled" && parameters.value("type", "") == "error") {
    errors_.push_back(parameters.dump());
  }
  if (method == "Log.entryAdded" && parameters["entry"].value("level", "") == "error") {
    errors_.push_back(parameters["entry"].value("text", "") + " " +
                      parameters["entry"].value("url", ""));
  }
}

}  // namespace treeroll::end_to_end
