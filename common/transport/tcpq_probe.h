#pragma once

#include <optional>
#include <string>

#include "common/transport/lcm_url.h"

namespace treeroll::transport {

/// Empty if a tcpq server answers at the URL's address within a second, otherwise why not. liblcm
/// itself waits without a limit: minutes for a host that is down, for ever for a server of another
/// kind that says nothing.
std::optional<std::string> tcpq_problem(const LcmUrl& url);

}  // namespace treeroll::transport
