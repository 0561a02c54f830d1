#include "common/transport/bus.h"

#include <fmt/format.h>

#include <cstdlib>
#include <utility>

#include "common/base/check.h"
#include "common/base/config_error.h"
#include "common/transport/lcm_bus.h"
#include "common/transport/lcm_url.h"

namespace treeroll::transport {
namespace {

Result<LcmUrl> read_url(const std::string& text, bool among_programs) {
  Result<LcmUrl> url = parse_lcm_url(text);
  if (!url || !among_programs) return url;
  if (url->provider == Provider::kUdpm || url->provider == Provider::kTcpq) return url;
  return Error{
      fmt::format("LCM URL \"{}\": reaches no other program, so learner and workers would not hear "
                  "each other: must be udpm or tcpq",
                  text)};
}

}  // namespace

std::string daemon_url(const char* option, const std::string& text) {
  std::string url = resolve_url(text);
  const bool is_of_variable = text.empty() && std::getenv(kUrlVariable) != nullptr;
  const Result<LcmUrl> read = read_url(url, true);
  if (!read) throw ConfigError(is_of_variable ? kUrlVariable : option, url, read.error().message);
  return url;
}

Result<std::unique_ptr<Bus>> open_bus(Loop& loop, BusOptions options) {
  CHECK(options.channels.empty() || options.on_message, "channels without on_message");
  Result<LcmUrl> url = read_url(options.url, options.among_programs);
  if (!url) return url.error();
  if (url->provider == Provider::kUdpm) {
    return open_udpm_bus(loop, *std::move(url), std::move(options));
  }
  return open_descriptor_bus(loop, *std::move(url), std::move(options));
}

}  // namespace treeroll::transport
