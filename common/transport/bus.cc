#include "common/transport/bus.h"

#include <fmt/format.h>

#include <utility>

#include "common/base/check.h"
#include "common/transport/lcm_bus.h"

namespace treeroll::transport {

Result<std::unique_ptr<Bus>> open_bus(Loop& loop, BusOptions options) {
  CHECK(options.channels.empty() || options.on_message, "channels without on_message");
  Result<LcmUrl> url = parse_lcm_url(options.url);
  if (!url) return url.error();
  const bool is_reached = url->provider == Provider::kUdpm || url->provider == Provider::kTcpq;
  if (options.among_programs && !is_reached) {
    return Error{
        fmt::format("LCM URL \"{}\": reaches no other program, so learner and workers "
                    "would not hear each other: must be udpm or tcpq",
                    options.url)};
  }
  if (url->provider == Provider::kUdpm) {
    return open_udpm_bus(loop, *std::move(url), std::move(options));
  }
  return open_descriptor_bus(loop, *std::move(url), std::move(options));
}

}  // namespace treeroll::transport
