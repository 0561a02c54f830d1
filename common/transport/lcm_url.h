#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"

namespace treeroll::transport {

enum class Provider { kUdpm, kTcpq, kMemq, kFile };

/// An LCM URL, read more strictly than liblcm does, which ignores what it does not understand:
///
///   udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304   multicast; a port left out is 7667
///   tcpq://127.0.0.1:7700                                   a server that passes messages on; 7700
///   memq://                                                 within this object
///   file://run.log?speed=0                                  reads a log; ?mode=w writes one
struct LcmUrl {
  /// What liblcm gets: as given, with what is left out filled in. liblcm would take a port that is
  /// not there for 0, and fail to send for ever.
  std::string text;
  Provider provider = Provider::kUdpm;
  std::string host;  ///< udpm: the group, tcpq: the server; dotted IPv4
  std::uint16_t port = 0;
  int ttl = 0;                   ///< udpm: 0 stays on this host
  int receive_buffer_bytes = 0;  ///< udpm: asked of the kernel, which may clip it
};

/// The variable that says the URL where no option does.
inline constexpr const char* kUrlVariable = "LCM_DEFAULT_URL";

/// udpm without recv_buf_size: room for a burst of a few hundred full batches.
inline constexpr int kReceiveBufferBytesDefault = 4 << 20;

/// Fails with the part that is wrong, its value and the rule.
Result<LcmUrl> parse_lcm_url(const std::string& url);

}  // namespace treeroll::transport
