#include "common/transport/bus.h"

#include <utility>

#include "common/base/check.h"
#include "common/transport/lcm_bus.h"

namespace treeroll::transport {

Result<std::unique_ptr<Bus>> open_bus(Loop& loop, BusOptions options) {
  CHECK(options.channels.empty() || options.on_message, "channels without on_message");
  Result<LcmUrl> url = parse_lcm_url(options.url);
  if (!url) return url.error();
  if (url->provider == Provider::kUdpm) {
    return open_udpm_bus(loop, *std::move(url), std::move(options));
  }
  return open_descriptor_bus(loop, *std::move(url), std::move(options));
}

}  // namespace treeroll::transport
