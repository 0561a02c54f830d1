#include "common/transport/lcm_url.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "common/transport/bus.h"

namespace treeroll::transport {
namespace {

using testing::HasSubstr;

TEST(LcmUrlTest, ReadsEveryPart) {
  const auto url = parse_lcm_url("udpm://239.255.77.1:7000?ttl=1&recv_buf_size=65536");
  ASSERT_TRUE(url) << url.error().message;
  EXPECT_EQ(url->provider, Provider::kUdpm);
  EXPECT_EQ(url->host, "239.255.77.1");
  EXPECT_EQ(url->port, 7000);
  EXPECT_EQ(url->ttl, 1);
  EXPECT_EQ(url->receive_buffer_bytes, 65536);
}

TEST(LcmUrlTest, HasLcmsDefaults) {
  const auto url = parse_lcm_url("udpm://");
  ASSERT_TRUE(url) << url.error().message;
  EXPECT_EQ(url->host, "239.255.76.67");
  EXPECT_EQ(url->port, 7667);
  EXPECT_EQ(url->ttl, 0);
  EXPECT_EQ(url->receive_buffer_bytes, kReceiveBufferBytesDefault);
  const auto server = parse_lcm_url("tcpq://");
  ASSERT_TRUE(server) << server.error().message;
  EXPECT_EQ(server->host, "127.0.0.1");
  EXPECT_EQ(server->port, 7700);
}

TEST(LcmUrlTest, ReadsEveryProvider) {
  for (const auto& [text, provider] : std::vector<std::pair<std::string, Provider>>{
           {"udpm://239.1.2.3:7667?ttl=2&recv_buf_size=65536", Provider::kUdpm},
           {"tcpq://192.0.2.7:7701", Provider::kTcpq},
           {"memq://", Provider::kMemq},
           {"file:///tmp/run.log?speed=0", Provider::kFile},
           {"file:///tmp/run.log?mode=w", Provider::kFile}}) {
    const auto url = parse_lcm_url(text);
    ASSERT_TRUE(url) << url.error().message;
    EXPECT_EQ(url->provider, provider);
    EXPECT_EQ(url->text, text);
  }
}

/// What is left out is not left to liblcm.
TEST(LcmUrlTest, GivesLiblcmAllOfIt) {
  for (const auto& [text, whole] : std::vector<std::pair<std::string, std::string>>{
           {"udpm://", "udpm://239.255.76.67:7667?ttl=0"},
           {"udpm://239.1.2.3", "udpm://239.1.2.3:7667?ttl=0"},
           {"udpm://239.1.2.3?recv_buf_size=65536,ttl=1",
            "udpm://239.1.2.3:7667?ttl=1&recv_buf_size=65536"},
           {"udpm://239.1.2.3:7700?", "udpm://239.1.2.3:7700?ttl=0"},
           {"tcpq://", "tcpq://127.0.0.1:7700"},
           {"tcpq://192.0.2.7", "tcpq://192.0.2.7:7700"}}) {
    const auto url = parse_lcm_url(text);
    ASSERT_TRUE(url) << url.error().message;
    EXPECT_EQ(url->text, whole);
  }
}

TEST(LcmUrlTest, BadOnesAreRefusedWithThePartTheValueAndTheRule) {
  const std::vector<std::pair<std::string, std::string>> table = {
      {"", "has no \"://\" after the provider"},
      {"239.255.76.67:7667", "has no \"://\""},
      {"udp://239.255.76.67:7667", "provider \"udp\" must be udpm, tcpq, memq or file"},
      {"://", "provider \"\" must be"},
      {"udpm://localhost:7667", "group \"localhost\" must be an IPv4 address"},
      {"udpm://239.255.76:7667", "group \"239.255.76\" must be an IPv4 address"},
      {"udpm://192.0.2.1:7667", "group \"192.0.2.1\" must be a multicast address"},
      {"udpm://239.255.76.67:", "port \"\" must be a whole number within 1..65535"},
      {"udpm://239.255.76.67:0", "port \"0\" must be"},
      {"udpm://239.255.76.67:65536", "port \"65536\" must be"},
      {"udpm://239.255.76.67:7667x", "port \"7667x\" must be"},
      {"udpm://239.255.76.67:7667?ttl=256", "ttl \"256\" must be a whole number within 0..255"},
      {"udpm://239.255.76.67:7667?ttl=-1", "ttl \"-1\" must be"},
      {"udpm://239.255.76.67:7667?ttl=", "ttl \"\" must be"},
      {"udpm://239.255.76.67:7667?ttl=one", "ttl \"one\" must be"},
      {"udpm://239.255.76.67:7667?ttl", "option \"ttl\" must read name=value"},
      {"udpm://239.255.76.67:7667?ttl=0&ttl=1", "option \"ttl\" stands twice"},
      {"udpm://239.255.76.67:7667?tll=1", "unknown option \"tll\"; known here: recv_buf_size, ttl"},
      {"udpm://239.255.76.67:7667?recv_buf_size=4MB", "recv_buf_size \"4MB\" must be"},
      {"udpm://239.255.76.67:7667?recv_buf_size=0", "recv_buf_size \"0\" must be"},
      {"udpm://239.255.76.67:7667?recv_buf_size=99999999999999999999", "recv_buf_size"},
      {"tcpq://somewhere:7700", "server \"somewhere\" must be an IPv4 address"},
      {"tcpq://127.0.0.1:7700?ttl=1", "unknown option \"ttl\"; known here: none"},
      {"memq://x", "\"x\" after memq:// must be absent"},
      {"file://", "the path of a log must follow file://"},
      {"file://x?speed=fast", "speed \"fast\" must be a number that is not negative"},
      {"file://x?speed=-1", "speed \"-1\" must be"},
      {"file://x?speed=nan", "speed \"nan\" must be"},
      {"file://x?start_timestamp=", "start_timestamp \"\" must be"},
      {"tcpq://127.0.0.1:0", "port \"0\" must be"},
      {"file://x?mode=x", "mode \"x\" must be r, w or a"},
  };
  for (const auto& [url, rule] : table) {
    const auto parsed = parse_lcm_url(url);
    ASSERT_FALSE(parsed) << url;
    EXPECT_THAT(parsed.error().message, HasSubstr("LCM URL \"" + url + "\": "));
    EXPECT_THAT(parsed.error().message, HasSubstr(rule));
  }
}

TEST(LcmUrlTest, TheOptionComesBeforeTheEnvironmentAndThatBeforeTheDefault) {
  ASSERT_EQ(unsetenv("LCM_DEFAULT_URL"), 0);
  EXPECT_EQ(resolve_url(""), "udpm://239.255.76.67:7667?ttl=0");
  ASSERT_EQ(setenv("LCM_DEFAULT_URL", "memq://", 1), 0);
  EXPECT_EQ(resolve_url(""), "memq://");
  EXPECT_EQ(resolve_url("udpm://239.1.1.1:1"), "udpm://239.1.1.1:1");
  ASSERT_EQ(setenv("LCM_DEFAULT_URL", "", 1), 0);
  EXPECT_EQ(resolve_url(""), "udpm://239.255.76.67:7667?ttl=0");
}

}  // namespace
}  // namespace treeroll::transport
