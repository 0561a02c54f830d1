#include "learner/web/http_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <cctype>

namespace treeroll::web {
namespace {

namespace http = boost::beast::http;

/// For every response. Nothing comes from elsewhere, and nobody else may frame or read it.
constexpr const char* kHeaders =
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Cache-Control: no-cache\r\n";

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char letter) { return std::tolower(letter); });
  return text;
}

std::string_view reason_of(int status) {
  return {http::obsolete_reason(static_cast<http::status>(status)).data(),
          http::obsolete_reason(static_cast<http::status>(status)).size()};
}

}  // namespace

ReadRequest read_request(std::string& input, std::size_t bytes_max) {
  const HttpResponse too_long = plain(431, "the request is too long");
  const std::size_t end_of_head = input.find("\r\n\r\n");
  if (end_of_head == std::string::npos) {
    if (input.size() <= bytes_max) return RequestIsNotWhole{};
    return too_long;
  }
  boost::system::error_code error;
  http::request_parser<http::empty_body> parser;
  parser.header_limit(static_cast<std::uint32_t>(bytes_max));
  parser.body_limit(0);
  const std::size_t used = parser.put(boost::asio::buffer(input.data(), end_of_head + 4), error);
  if (error == http::error::header_limit) return too_long;
  // A body that is too long ends the reading before the head counts as done.
  const bool has_long_body = error == http::error::body_limit;
  if (!has_long_body && (error || !parser.is_header_done())) {
    return plain(400, "this is no request of HTTP");
  }
  const auto& message = parser.get();
  HttpRequest request;
  request.keeps_alive = message.keep_alive();
  request.is_head = message.method() == http::verb::head;
  if (message.method() != http::verb::get && !request.is_head) {
    HttpResponse response = plain(405, "only GET and HEAD are answered");
    response.headers = {{"Allow", "GET, HEAD"}};
    return response;
  }
  if (has_long_body || !parser.is_done()) return plain(413, "a request has no body here");
  input.erase(0, used);
  for (const auto& field : message) {
    std::string& value = request.headers[lower(std::string(field.name_string()))];
    if (!value.empty()) value += ", ";  // repeated: no single Host, say
    value += std::string(field.value());
  }
  if (!read_target(std::string(message.target()), request)) {
    return plain(400, "this is no address of a page");
  }
  return request;
}

std::string head_of(const HttpResponse& response, bool keeps_alive) {
  std::string head =
      fmt::format("HTTP/1.1 {} {}\r\n{}", response.status, reason_of(response.status), kHeaders);
  const auto add = [&](const std::string& name, const std::string& value) {
    head += fmt::format("{}: {}\r\n", name, value);
  };
  if (response.status != 304) {
    add("Content-Type", response.type);
    add("Content-Length", std::to_string(response.body->size()));
  }
  if (!response.etag.empty()) add("ETag", response.etag);
  for (const auto& [name, value] : response.headers) add(name, value);
  add("Connection", keeps_alive ? "keep-alive" : "close");
  return head + "\r\n";
}

}  // namespace treeroll::web
