#include "learner/web/http_access.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sodium.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <string_view>

#include "common/base/config_error.h"
#include "common/base/content_hash.h"
#include "common/files/secret_file.h"

namespace treeroll::web {
namespace {

constexpr std::size_t kTokenMin = 16;
constexpr std::size_t kTokenMax = 256;
constexpr std::size_t kTokenFileBytesMax = 4096;
constexpr std::size_t kCookieDigits = 8;  // hexadecimal, of a hash

bool is_ipv4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

bool is_ipv6(const std::string& text) {
  in6_addr address{};
  return inet_pton(AF_INET6, text.c_str(), &address) == 1;
}

/// Host and port of "host:port", "[::1]:port", "host". The port is not looked at: a tunnel (ssh -L)
/// has another one than we have.
std::string host_of(const std::string& header) {
  if (header.starts_with('[')) {
    const std::size_t end = header.find(']');
    return end == std::string::npos ? "" : header.substr(1, end - 1);
  }
  return header.substr(0, header.find(':'));
}

std::string in_small_letters(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char letter) { return std::tolower(letter); });
  return text;
}

bool is_our_name(const HttpAccess& access, const std::string& given) {
  const std::string host = in_small_letters(given);
  // An address is no name that somebody could let lead here.
  if (host == "localhost" || is_ipv4(host) || is_ipv6(host)) return true;
  const std::string own = in_small_letters(access.host_name);
  if (own.empty()) return false;
  if (host == own || host == own + ".local") return true;
  // Anybody may own a domain and call a host of it as ours is called: there a token must be known.
  return !access.token.empty() && host.starts_with(own + ".");
}

/// In a time that does not tell how much of it agrees.
bool is_token(const HttpAccess& access, const std::string& given) {
  return given.size() == access.token.size() &&
         sodium_memcmp(given.data(), access.token.data(), given.size()) == 0;
}

std::string header_of(const HttpRequest& request, const std::string& name) {
  const auto found = request.headers.find(name);
  return found == request.headers.end() ? "" : found->second;
}

bool has_token(const HttpAccess& access, const HttpRequest& request) {
  constexpr std::string_view kBearer = "Bearer ";
  const std::string authorization = header_of(request, "authorization");
  if (authorization.starts_with(kBearer) &&
      is_token(access, authorization.substr(kBearer.size()))) {
    return true;
  }
  std::string_view rest;
  const std::string cookies = header_of(request, "cookie");
  const std::string name = token_cookie_of(access.token) + "=";
  for (rest = cookies; !rest.empty();) {
    const std::size_t end = std::min(rest.find(';'), rest.size());
    std::string_view cookie = rest.substr(0, end);
    rest.remove_prefix(std::min(rest.size(), end + 1));
    cookie.remove_prefix(std::min(cookie.find_first_not_of(' '), cookie.size()));
    if (cookie.starts_with(name) && is_token(access, std::string(cookie.substr(name.size())))) {
      return true;
    }
  }
  return false;
}

}  // namespace

bool HttpAddress::is_loopback() const { return host.starts_with("127.") || host == "::1"; }

HttpAddress read_http_address(const std::string& option, const std::string& text) {
  HttpAddress address;
  const std::size_t colon = text.rfind(':');
  std::string port = text;
  if (colon != std::string::npos) {
    address.host = text.substr(0, colon);
    port = text.substr(colon + 1);
    const bool in_brackets = address.host.starts_with('[') && address.host.ends_with(']');
    if (in_brackets) address.host = address.host.substr(1, address.host.size() - 2);
    if (address.host == "localhost") address.host = "127.0.0.1";
    if (in_brackets ? !is_ipv6(address.host) : !is_ipv4(address.host)) {
      throw ConfigError(option, text,
                        "must be [ADDRESS:]PORT with an IP address: 8080, 127.0.0.1:8080, "
                        "[::1]:8080, 0.0.0.0:8080");
    }
  }
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), address.port);
  if (error != std::errc{} || end != port.data() + port.size() || port.empty()) {
    throw ConfigError(option, text, "must be [ADDRESS:]PORT, the port from 0 to 65535; 0: any");
  }
  return address;
}

std::string read_token_file(const std::string& option, const std::filesystem::path& file) {
  std::string token;
  try {
    token = read_secret_file(file, kTokenFileBytesMax);
  } catch (const std::runtime_error& error) {
    throw ConfigError(option, file.string(),
                      fmt::format("must be a file that can be read: {}", error.what()));
  }
  while (token.ends_with('\n') || token.ends_with('\r')) token.pop_back();
  const bool is_visible = std::all_of(token.begin(), token.end(), [](unsigned char byte) {
    return std::isalnum(byte) != 0 ||
           std::string_view("-._~").find(static_cast<char>(byte)) != std::string_view::npos;
  });
  if (token.size() < kTokenMin || token.size() > kTokenMax || !is_visible) {
    throw ConfigError(
        option, file.string(),
        fmt::format("must hold one line of {} to {} characters among A-Z a-z 0-9 - . _ ~, "
                    "which an address can hold as they are: openssl rand -hex 16",
                    kTokenMin, kTokenMax));
  }
  return token;
}

std::string token_cookie_of(const std::string& token) {
  return "treeroll_token_" + to_hex(content_hash(token)).substr(0, kCookieDigits);
}

std::optional<HttpResponse> refusal_of(const HttpAccess& access, const HttpRequest& request) {
  const std::string host = host_of(header_of(request, "host"));
  if (!is_our_name(access, host)) {
    return plain(421, "this is not the host that was asked for: take its address, or localhost");
  }
  const std::string site = header_of(request, "sec-fetch-site");
  // A link may lead to the page. What lies below it is for the page to ask: an answer may take a
  // simulation.
  const bool is_link = request.path == "/" && header_of(request, "sec-fetch-mode") == "navigate";
  if (site == "cross-site" && !is_link) {
    return plain(403, "pages of other sites may link to /, and ask nothing");
  }
  if (access.token.empty() || request.path == "/healthz") return std::nullopt;
  const auto given = request.query.find("token");
  if (request.path == "/" && given != request.query.end() && is_token(access, given->second)) {
    HttpResponse response = plain(303, "go on to /");
    // Lax: whoever has followed a link of another site comes to / with it. What else such a site
    // asks is refused above, with the cookie or without.
    response.headers = {{"Location", "/"},
                        {"Set-Cookie", token_cookie_of(access.token) + "=" + access.token +
                                           "; HttpOnly; SameSite=Lax; Path=/"}};
    return response;
  }
  if (has_token(access, request)) return std::nullopt;
  HttpResponse response =
      plain(401, "a token is needed: open /?token=TOKEN, or send it as Authorization: Bearer");
  response.headers = {{"WWW-Authenticate", "Bearer realm=\"treeroll\""}};
  return response;
}

}  // namespace treeroll::web
