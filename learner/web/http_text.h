#pragma once

#include <cstddef>
#include <string>
#include <variant>

#include "learner/web/http_message.h"

namespace treeroll::web {

/// More is to come.
struct RequestIsNotWhole {};

/// A request, or the response that refuses what is there: the connection ends with it.
using ReadRequest = std::variant<RequestIsNotWhole, HttpRequest, HttpResponse>;

/// Takes the first request out of what a browser has sent. Whole headers or nothing: what is there
/// is looked at once more with each part that comes.
/// @param bytes_max  of line and headers
ReadRequest read_request(std::string& input, std::size_t bytes_max);

/// Status line and headers, up to the body.
std::string head_of(const HttpResponse& response, bool keeps_alive);

}  // namespace treeroll::web
