#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace treeroll::web {

/// What a browser asks: GET, or HEAD, which the server answers as GET without the body.
struct HttpRequest {
  std::string path;                            ///< "/api/state", percent signs decoded
  std::map<std::string, std::string> query;    ///< decoded; of a name that is repeated the last
  std::map<std::string, std::string> headers;  ///< names in lower case
  bool is_head = false;
  bool keeps_alive = false;  ///< wants to ask again over this connection
};

struct HttpResponse {
  int status = 200;
  std::string type = "application/json";
  /// Shared with whatever has cached it: many browsers read one text.
  std::shared_ptr<const std::string> body = std::make_shared<const std::string>();
  std::string etag = {};  ///< in quotes; whoever has it already is told so (304)
  std::vector<std::pair<std::string, std::string>> headers = {};
};

/// Called in the loop; what it throws is answered with 500.
using HttpHandler = std::function<HttpResponse(const HttpRequest&)>;

/// A short answer in words.
HttpResponse plain(int status, const std::string& text);

/// "/api/runs?condition=a%20b" as path and query. False for what is no target of a request: an
/// absent slash, a percent sign before anything but two hexadecimal digits, a control character.
bool read_target(const std::string& target, HttpRequest& request);

}  // namespace treeroll::web
