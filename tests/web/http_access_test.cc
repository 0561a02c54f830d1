#include "learner/web/http_access.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/base/config_error.h"
#include "learner/web/time_share.h"
#include "tests/files/scratch_folder.h"

namespace treeroll::web {
namespace {

using testing::HasSubstr;

constexpr const char* kToken = "0123456789abcdefSECRET";

int status_of(const HttpAccess& access, const std::string& target,
              std::map<std::string, std::string> headers) {
  HttpRequest request;
  EXPECT_TRUE(read_target(target, request));
  request.headers = std::move(headers);
  const std::optional<HttpResponse> refusal = refusal_of(access, request);
  return refusal ? refusal->status : 200;
}

TEST(HttpAccessTest, OnlyOurOwnNamesAreAnsweredSoThatNoForeignNameLeadsHere) {
  const HttpAccess access{.token = {}, .host_name = "Lab7"};
  for (const char* host : {"localhost", "localhost:8080", "127.0.0.1:80", "[::1]:8080", "LAB7:1",
                           "lab7.local:80", "192.168.1.7"}) {
    EXPECT_EQ(status_of(access, "/", {{"host", host}}), 200) << host;
  }
  for (const char* host :
       {"", "evil.com", "lab7.evil.com", "evil.com:8080", "lab77", "lab7evil.com",
        "127.0.0.1.evil.com", "localhost.evil.com", "[::1", "localhost, evil"}) {
    EXPECT_EQ(status_of(access, "/api/state", {{"host", host}}), 421) << host;
  }
  EXPECT_EQ(status_of(access, "/", {}), 421);
}

TEST(HttpAccessTest, OfOurNameInADomainATokenIsAsked) {
  const HttpAccess access{.token = kToken, .host_name = "lab7"};
  EXPECT_EQ(status_of(access, "/api/state", {{"host", "lab7.example.org"}}), 401);
  EXPECT_EQ(
      status_of(access, "/api/state",
                {{"host", "lab7.example.org"}, {"authorization", std::string("Bearer ") + kToken}}),
      200);
  EXPECT_EQ(status_of(access, "/api/state", {{"host", "lab77.example.org"}}), 421);
}

TEST(HttpAccessTest, PagesOfOtherSitesMayLinkButNotAsk) {
  const HttpAccess access;
  const std::map<std::string, std::string> foreign = {{"host", "localhost"},
                                                      {"sec-fetch-site", "cross-site"}};
  EXPECT_EQ(status_of(access, "/api/state", foreign), 403);
  auto link = foreign;
  link["sec-fetch-mode"] = "navigate";
  EXPECT_EQ(status_of(access, "/", link), 200);
  for (const char* asked : {"/api/rollouts/0/0", "/api/state", "/metrics"}) {
    EXPECT_EQ(status_of(access, asked, link), 403) << asked;
  }
}

TEST(HttpAccessTest, ATokenIsAskedForInEveryPlaceButHealth) {
  const HttpAccess access{.token = kToken, .host_name = {}};
  const auto with = [&](const std::string& name, const std::string& value) {
    return status_of(access, "/api/state", {{"host", "127.0.0.1"}, {name, value}});
  };
  EXPECT_EQ(with("x", "y"), 401);
  EXPECT_EQ(with("authorization", std::string("Bearer ") + kToken), 200);
  EXPECT_EQ(with("authorization", std::string("Bearer ") + kToken + "x"), 401);
  EXPECT_EQ(with("authorization", "Bearer "), 401);
  EXPECT_EQ(with("authorization", kToken), 401);
  const std::string name = token_cookie_of(kToken);
  EXPECT_EQ(with("cookie", "a=b; " + name + "=" + kToken + "; c=d"), 200);
  EXPECT_EQ(with("cookie", name + "=0123456789abcdefWRONGX"), 401);
  EXPECT_EQ(with("cookie", "x" + name + "=" + kToken), 401);
  EXPECT_EQ(status_of(access, "/healthz", {{"host", "127.0.0.1"}}), 200);
  EXPECT_EQ(status_of(access, "/api/state?token=" + std::string(kToken), {{"host", "localhost"}}),
            401);
  EXPECT_EQ(status_of(access, "/?token=wrong", {{"host", "localhost"}}), 401);
  EXPECT_EQ(status_of(access, "/?token=" + std::string(kToken), {{"host", "localhost"}}), 303);
}

/// The cookie, "name=value", that a page gives to whoever opens it with its token.
std::string cookie_of(const HttpAccess& access) {
  HttpRequest request;
  EXPECT_TRUE(read_target("/?token=" + access.token, request));
  request.headers = {{"host", "localhost"}};
  const HttpResponse response = refusal_of(access, request).value();
  for (const auto& [name, value] : response.headers) {
    if (name == "Set-Cookie") return value.substr(0, value.find(';'));
  }
  return "";
}

/// Cookies know no port: a browser keeps one of a name for all that listens on a host.
TEST(HttpAccessTest, TwoPagesOfOneHostKeepTheirTokensBesideEachOther) {
  const HttpAccess first{.token = kToken, .host_name = {}};
  const HttpAccess second{.token = std::string("another") + kToken, .host_name = {}};
  std::map<std::string, std::string> kept;
  for (const HttpAccess& access : {first, second}) {
    const std::string cookie = cookie_of(access);
    kept[cookie.substr(0, cookie.find('='))] = cookie;
  }
  std::string cookies;
  for (const auto& [name, cookie] : kept) cookies += (cookies.empty() ? "" : "; ") + cookie;
  EXPECT_EQ(status_of(first, "/", {{"host", "localhost"}, {"cookie", cookies}}), 200);
  EXPECT_EQ(status_of(second, "/", {{"host", "localhost"}, {"cookie", cookies}}), 200);
}

TEST(HttpAccessTest, ReadsAddressesStrictly) {
  EXPECT_EQ(read_http_address("--http", "8080").port, 8080);
  EXPECT_TRUE(read_http_address("--http", "8080").is_loopback());
  EXPECT_EQ(read_http_address("--http", "0.0.0.0:80").host, "0.0.0.0");
  EXPECT_FALSE(read_http_address("--http", "0.0.0.0:80").is_loopback());
  EXPECT_EQ(read_http_address("--http", "[::1]:0").host, "::1");
  EXPECT_TRUE(read_http_address("--http", "localhost:9").is_loopback());
  for (const char* text : {"", ":", "x", "65536", "-1", "80x", "host:80", "::1:80", "[::1]",
                           "1.2.3:80", "127.0.0.1:", ":80", "127.0.0.1.evil:80"}) {
    EXPECT_THROW(read_http_address("--http", text), ConfigError) << text;
  }
}

TEST(HttpAccessTest, ATokenFileIsOneSecretLine) {
  const ScratchFolder scratch;
  const std::filesystem::path file = scratch.path() / "token";
  const auto read = [&](const std::string& text, std::filesystem::perms others) {
    std::ofstream(file) << text;
    std::filesystem::permissions(file, std::filesystem::perms::owner_all | others);
    return read_token_file("--http-token-file", file);
  };
  const auto none = std::filesystem::perms::none;
  EXPECT_EQ(read(std::string(kToken) + "\n", none), kToken);
  EXPECT_THROW(read(std::string(kToken), std::filesystem::perms::group_read), ConfigError);
  std::filesystem::remove(file);
  EXPECT_THROW(read("short", none), ConfigError);
  EXPECT_THROW(read("two lines of text\nhere", none), ConfigError);
  EXPECT_THROW(read("0123456789abcdef;evil", none), ConfigError);
  EXPECT_THROW(read_token_file("--http-token-file", scratch.path() / "absent"), ConfigError);
}

TEST(HttpTargetTest, IsDecodedOrRefused) {
  HttpRequest request;
  ASSERT_TRUE(read_target("/api/runs?condition=1&order=a%20b+c&x", request));
  EXPECT_EQ(request.path, "/api/runs");
  EXPECT_EQ(request.query, (std::map<std::string, std::string>{
                               {"condition", "1"}, {"order", "a b c"}, {"x", ""}}));
  for (const char* target : {"", "*", "http://x/", "/%", "/%4", "/%zz", "/%00", "/a?b=%0a"}) {
    HttpRequest none;
    EXPECT_FALSE(read_target(target, none)) << target;
  }
}

TEST(TimeShareTest, GivesNoMoreThanItsShareHoweverMuchIsAsked) {
  using std::chrono::microseconds;
  using std::chrono::milliseconds;
  TimeShare share({.share = .05, .at_once = milliseconds(100)});
  TimePoint now{std::chrono::seconds(5)};
  const TimePoint end = now + std::chrono::seconds(100);
  Duration used{};
  while (now < end) {
    now = std::max(now, share.next(now));
    const Duration work = microseconds(3000);
    share.use(now, work);
    now += work;
    used += work;
  }
  EXPECT_NEAR(to_seconds(used), 5.1, .05);
}

TEST(TimeShareTest, WhoWasStillMayWorkAtOnce) {
  using std::chrono::milliseconds;
  TimeShare share({.share = .05, .at_once = milliseconds(100)});
  TimePoint now{std::chrono::seconds(5)};
  share.use(now, std::chrono::seconds(1));
  EXPECT_EQ(share.next(now + milliseconds(1)) > now + std::chrono::seconds(10), true);
  now += std::chrono::seconds(1000);
  EXPECT_EQ(share.next(now), now);
}

}  // namespace
}  // namespace treeroll::web
