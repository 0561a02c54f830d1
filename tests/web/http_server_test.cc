#include "learner/web/http_server.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "common/base/config_error.h"

namespace treeroll::web {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

/// A server in a thread of its own; at "/large" are so many bytes.
class HttpServerTest : public testing::Test {
 protected:
  static constexpr std::size_t kLarge = 8'000'000;

  void start(HttpLimits limits = {.thread = {.share = .9, .at_once = seconds(1)}}) {
    server_ = std::make_unique<HttpServer>(
        loop_, "--http", HttpAddress{}, HttpAccess{},
        [this](const HttpRequest& request) -> HttpResponse {
          if (request.path == "/large") return {.body = large_};
          if (request.path == "/throw") throw std::runtime_error("it broke");
          if (request.path == "/tag") return {.body = large_, .etag = "\"7\""};
          return plain(200, "here is " + request.path);
        },
        limits);
    port_ = server_->port();
    thread_ = std::thread([this] {
      // The loop's own work: it must go on whatever browsers do.
      transport::Timer timer(loop_, [&] {
        num_connections_ = server_->num_connections();
        num_requests_ = server_->num_requests();
        ++ticks_;
        timer.set(loop_.now() + milliseconds(1));
      });
      timer.set(loop_.now());
      loop_.run();
    });
  }

  ~HttpServerTest() override {
    if (thread_.joinable()) {
      loop_.stop();
      thread_.join();
    }
  }

  class Browser {
   public:
    explicit Browser(std::uint16_t port, int receive_bytes = 0, int patience_s = 20) {
      descriptor_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      if (receive_bytes > 0) {
        setsockopt(descriptor_, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
      }
      timeval patience{.tv_sec = patience_s, .tv_usec = 0};
      setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
      setsockopt(descriptor_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_port = htons(port);
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      is_connected_ =
          connect(descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    }
    ~Browser() { close(descriptor_); }
    Browser(const Browser&) = delete;
    Browser& operator=(const Browser&) = delete;

    bool is_connected() const { return is_connected_; }
    bool send(const std::string& bytes) const {
      return ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
             static_cast<ssize_t>(bytes.size());
    }
    /// Up to the end of the stream, or of patience.
    /// At most so much of what is there.
    std::string some(std::size_t size) const {
      std::string text(size, '\0');
      const ssize_t got = ::recv(descriptor_, text.data(), size, MSG_DONTWAIT);
      text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
      return text;
    }
    std::string rest() const {
      std::string text;
      char bytes[65536];
      for (ssize_t size = 0; (size = recv(descriptor_, bytes, sizeof bytes, 0)) > 0;) {
        text.append(bytes, static_cast<std::size_t>(size));
      }
      return text;
    }
    /// A response with a known body's length.
    std::string response(std::size_t body_bytes) const {
      std::string text;
      char bytes[65536];
      for (;;) {
        const std::size_t head = text.find("\r\n\r\n");
        if (head != std::string::npos && text.size() >= head + 4 + body_bytes) return text;
        const ssize_t size = recv(descriptor_, bytes, sizeof bytes, 0);
        if (size <= 0) return text + "<ended>";
        text.append(bytes, static_cast<std::size_t>(size));
      }
    }

   private:
    int descriptor_ = -1;
    bool is_connected_ = false;
  };

  std::string ask(const std::string& request) const {
    const Browser browser(port_);
    browser.send(request);
    return browser.rest();
  }
  std::string get(const std::string& path) const {
    return ask("GET " + path + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  }

  transport::Loop loop_;
  std::shared_ptr<const std::string> large_ = std::make_shared<const std::string>(kLarge, 'x');
  std::unique_ptr<HttpServer> server_;
  std::uint16_t port_ = 0;
  std::atomic<std::int64_t> ticks_{0};
  std::atomic<std::size_t> num_connections_{0};  // at the last tick
  std::atomic<std::int64_t> num_requests_{0};
  std::thread thread_;
};

TEST_F(HttpServerTest, AnswersOneRequestAfterTheOtherOnAConnection) {
  start();
  const Browser browser(port_);
  for (const std::string path : {"/a", "/b", "/c"}) {
    ASSERT_TRUE(browser.send("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n"));
    const std::string response = browser.response(11);
    EXPECT_THAT(response, StartsWith("HTTP/1.1 200 OK\r\n"));
    EXPECT_THAT(response, HasSubstr("Content-Security-Policy: default-src 'none'"));
    EXPECT_THAT(response, EndsWith("here is " + path + "\n"));
  }
  // Two at once are answered in their order.
  browser.send(
      "GET /1 HTTP/1.1\r\nHost: localhost\r\n\r\n"
      "GET /2 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  const std::string both = browser.rest();
  EXPECT_LT(both.find("here is /1"), both.find("here is /2"));
}

TEST_F(HttpServerTest, RefusesWhatIsNoRequestAndHangsUp) {
  start();
  EXPECT_THAT(ask("\x16\x03\x01 hello\r\n\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(ask("GET / HTTP/9.9\r\n\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(ask("POST / HTTP/1.1\r\nHost: localhost\r\n\r\n"), StartsWith("HTTP/1.1 405 "));
  const std::string body = "Host: localhost\r\nContent-Length: 5\r\n\r\nhello";
  EXPECT_THAT(ask("GET / HTTP/1.1\r\n" + body), StartsWith("HTTP/1.1 413 "));
  EXPECT_THAT(ask("POST / HTTP/1.1\r\n" + body),
              testing::AllOf(StartsWith("HTTP/1.1 405 "), HasSubstr("Allow: GET, HEAD\r\n")));
  EXPECT_THAT(ask("GET /%zz HTTP/1.1\r\nHost: localhost\r\n\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(ask("GET / HTTP/1.1\r\nHost: evil.com\r\nConnection: close\r\n\r\n"),
              StartsWith("HTTP/1.1 421 "));
  EXPECT_THAT(
      ask("GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.com\r\nConnection: close\r\n\r\n"),
      StartsWith("HTTP/1.1 421 "));
  EXPECT_THAT(ask("GET /" + std::string(20'000, 'a') + " HTTP/1.1\r\nHost: localhost\r\n\r\n"),
              StartsWith("HTTP/1.1 431 "));
  std::string many = "GET / HTTP/1.1\r\nHost: localhost\r\n";
  for (int i = 0; i < 2000; ++i) many += "X-" + std::to_string(i) + ": y\r\n";
  EXPECT_THAT(ask(many + "\r\n"), StartsWith("HTTP/1.1 431 "));
  EXPECT_THAT(get("/throw"), HasSubstr("it broke"));
  EXPECT_THAT(get("/throw"), StartsWith("HTTP/1.1 500 "));
  EXPECT_THAT(get("/well"), EndsWith("here is /well\n"));
}

TEST_F(HttpServerTest, HeadHasNoBodyAndWhatIsKnownIsNotSentAgain) {
  start();
  const std::string head =
      ask("HEAD /large HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(head, HasSubstr("Content-Length: 8000000\r\n"));
  EXPECT_THAT(head, EndsWith("\r\n\r\n"));
  const std::string known = ask(
      "GET /tag HTTP/1.1\r\nHost: localhost\r\nIf-None-Match: \"7\"\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(known, StartsWith("HTTP/1.1 304 "));
  EXPECT_THAT(known, EndsWith("\r\n\r\n"));
}

TEST_F(HttpServerTest, ALargeResponseArrivesWhole) {
  start();
  const std::string response = get("/large");
  EXPECT_EQ(response.size() - response.find("\r\n\r\n") - 4, kLarge);
}

TEST_F(HttpServerTest, BrowsersThatNeverReadHoldNobodyUp) {
  start({.response = milliseconds(1500), .thread = {.share = .9, .at_once = seconds(1)}});
  std::vector<std::unique_ptr<Browser>> deaf;
  for (int i = 0; i < 20; ++i) {
    deaf.push_back(std::make_unique<Browser>(port_, 2048));
    ASSERT_TRUE(deaf.back()->send("GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  }
  const std::int64_t before = ticks_;
  for (int i = 0; i < 50; ++i) ASSERT_THAT(get("/well"), EndsWith("here is /well\n"));
  EXPECT_GT(ticks_, before);
  // Then they are hung up on: what they get is cut off.
  std::this_thread::sleep_for(seconds(3));
  const std::string part = deaf.front()->rest();
  EXPECT_LT(part.size(), kLarge);
}

TEST_F(HttpServerTest, WhoReadsALittleNowAndThenIsHungUpOnToo) {
  start({.response = seconds(1),
         .response_in_all = seconds(3),
         .thread = {.share = .9, .at_once = seconds(1)}});
  const Browser slow(port_, 2048);
  ASSERT_TRUE(slow.send("GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  std::size_t num_read = 0;
  for (int i = 0; i < 25; ++i) {  // 5 s
    num_read += slow.some(40'000).size();
    std::this_thread::sleep_for(milliseconds(200));
  }
  EXPECT_EQ(num_connections_, 0U);
  EXPECT_LT(num_read, kLarge);
}

TEST_F(HttpServerTest, ThousandsOfConnectionsLeaveRoomForTheNext) {
  start();
  std::vector<std::unique_ptr<Browser>> idle;
  for (int i = 0; i < 300; ++i) {
    idle.push_back(std::make_unique<Browser>(port_));
    if (i % 2 == 0) idle.back()->send("GET / HT");
  }
  EXPECT_THAT(get("/well"), EndsWith("here is /well\n"));
  EXPECT_LE(num_connections_, HttpLimits{}.connections_max);
}

TEST_F(HttpServerTest, AFloodOfRequestsLeavesTheLoopItsTime) {
  start({.thread = {.share = .02, .at_once = milliseconds(5)}});
  std::atomic<bool> is_over{false};
  std::vector<std::thread> flood;
  for (int i = 0; i < 4; ++i) {
    flood.emplace_back([&] {
      const Browser browser(port_, 0, 1);
      while (!is_over && browser.send("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")) {
      }
    });
    flood.emplace_back([&] {
      while (!is_over) {
        const Browser browser(port_, 0, 1);
        browser.send("G");
      }
    });
  }
  timespec thread_time{};
  clockid_t clock{};
  ASSERT_EQ(pthread_getcpuclockid(thread_.native_handle(), &clock), 0);
  const auto used_s = [&] {
    clock_gettime(clock, &thread_time);
    return static_cast<double>(thread_time.tv_sec) +
           1e-9 * static_cast<double>(thread_time.tv_nsec);
  };
  const double before_s = used_s();
  const auto begin = std::chrono::steady_clock::now();
  std::this_thread::sleep_for(seconds(3));
  const double elapsed_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double share = (used_s() - before_s) / elapsed_s;
  is_over = true;
  for (std::thread& each : flood) each.join();
  // Two hundredths, and what the loop's own thousand ticks a second take.
  EXPECT_LT(share, .15);
  EXPECT_GT(num_requests_, 0);
}

TEST_F(HttpServerTest, AnAddressThatIsTakenIsNamed) {
  start();
  transport::Loop loop;
  try {
    const HttpServer second(loop, "--http", {.host = "127.0.0.1", .port = port_}, {}, {});
    FAIL() << "two servers at one address";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("--http"));
    EXPECT_THAT(error.what(), HasSubstr("in use"));
  }
}

}  // namespace
}  // namespace treeroll::web
