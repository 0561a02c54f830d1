#include "common/transport/bus.h"

#include <fmt/format.h>

#include <cstdlib>
#include <optional>
#include <utility>

#include "common/base/check.h"
#include "common/base/config_error.h"
#include "common/transport/lcm_bus.h"
#include "common/transport/lcm_url.h"

namespace treeroll::transport {
namespace {

std::optional<Error> problem(const std::string& url, bool among_programs) {
  const Result<LcmUrl> read = parse_lcm_url(url);
  if (!read) return read.error();
  const bool is_reached = read->provider == Provider::kUdpm || read->provider == Provider::kTcpq;
  if (!among_programs || is_reached) return std::nullopt;
  return Error{
      fmt::format("LCM URL \"{}\": reaches no other program, so learner and workers would not hear "
                  "each other: must be udpm or tcpq",
                  url)};
}

}  // namespace

std::string daemon_url(const char* option, const std::string& text) {
  std::string url = resolve_url(text);
  const bool is_of_variable = text.empty() && std::getenv(kUrlVariable) != nullptr;
  if (const auto error = problem(url, true)) {
    throw ConfigError(is_of_variable ? kUrlVariable : option, url, error->message);
  }
  return url;
}

Result<std::unique_ptr<Bus>> open_bus(Loop& loop, BusOptions options) {
  CHECK(options.channels.empty() || options.on_message, "channels without on_message");
  if (auto error = problem(options.url, options.among_programs)) return *std::move(error);
  Result<LcmUrl> url = parse_lcm_url(options.url);
  if (url->provider == Provider::kUdpm) {
    return open_udpm_bus(loop, *std::move(url), std::move(options));
  }
  return open_descriptor_bus(loop, *std::move(url), std::move(options));
}

}  // namespace treeroll::transport
