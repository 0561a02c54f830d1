#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "learner/web/http_message.h"

namespace treeroll::web {

/// Where a server listens, and whom it answers.
struct HttpAddress {
  std::string host = "127.0.0.1";  ///< an IP address
  std::uint16_t port = 0;          ///< 0: one that is free
  bool is_loopback() const;
};

/// "[ADDRESS:]PORT": "8080", "127.0.0.1:8080", "[::1]:0". Throws ConfigError under `option`.
HttpAddress read_http_address(const std::string& option, const std::string& text);

/// The token in a file: one line of 16 to 256 letters, digits and - . _ ~, in a file that nobody
/// else may read. Throws ConfigError under `option`.
std::string read_token_file(const std::string& option, const std::filesystem::path& file);

/// Who may read the page.
struct HttpAccess {
  /// Empty: whoever can connect. Else the request must bring it, as a cookie or as a bearer.
  std::string token;
  std::string host_name;  ///< of this host, by which a page may be asked for, too
};

/// The name of the cookie that holds a token: one of its own for each. Browsers send a cookie to
/// every port of a host, so the pages of two learners would overwrite one of the same name.
std::string token_cookie_of(const std::string& token);

/// Answers a request that must not reach the page:
/// - one that names another host (a page elsewhere whose name now leads here: DNS rebinding);
/// - one that a page of another site makes;
/// - one without the token. /?token=TOKEN puts it into a cookie and leads to the page.
/// Nothing: the request may pass. "/healthz" needs no token, it tells nothing.
std::optional<HttpResponse> refusal_of(const HttpAccess& access, const HttpRequest& request);

}  // namespace treeroll::web
