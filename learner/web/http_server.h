#pragma once

#include <cstdint>
#include <memory>

#include "common/transport/loop.h"
#include "learner/web/http_access.h"
#include "learner/web/http_message.h"
#include "learner/web/time_share.h"

namespace treeroll::web {

/// What a server allows the world. A browser asks twice a second over one connection or two.
struct HttpLimits {
  std::size_t connections_max = 64;             ///< past it the one that has been idle longest ends
  std::size_t request_bytes_max = 8192;         ///< of line and headers
  Duration request = std::chrono::seconds(10);  ///< from its first byte to its last
  Duration idle = std::chrono::seconds(60);     ///< between two requests of a connection
  Duration response = std::chrono::seconds(30);         ///< without reading any of it
  Duration response_in_all = std::chrono::minutes(10);  ///< from its first byte to its last
  /// Of this thread: everything the server does, for however many browsers.
  TimeShare::Limit thread{.share = 0.05, .at_once = std::chrono::milliseconds(100)};
};

/// HTTP in a daemon's loop, for a few people who watch: it has no thread of its own, and takes no
/// more than a share of the loop's. Past it all connections wait, each for its turn. A connection
/// holds one request or one response, never a queue.
class HttpServer {
 public:
  /// Listens, and answers once the loop runs. Throws ConfigError under `option` if it cannot.
  /// Precondition: loop and handler outlive it.
  HttpServer(transport::Loop& loop, const std::string& option, const HttpAddress& address,
             HttpAccess access, HttpHandler handler, HttpLimits limits = {});
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  std::uint16_t port() const;
  /// "http://127.0.0.1:8080/".
  std::string url() const;
  std::size_t num_connections() const;
  std::int64_t num_requests() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace treeroll::web
