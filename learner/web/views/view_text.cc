#include "learner/web/views/view_text.h"

#include <nlohmann/json.hpp>

namespace treeroll::web {

std::string dumped(const nlohmann::json& view) {
  return view.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace treeroll::web
