#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace treeroll::web {

/// As text. Text from outside that is no UTF-8 is replaced: nothing throws.
std::string dumped(const nlohmann::json& view);

}  // namespace treeroll::web
