#pragma once

#include <span>
#include <string_view>

namespace treeroll::web {

/// A file of learner/web/page, as it was when this was built.
struct PageFile {
  std::string_view name;  ///< "page.css"
  std::string_view hash;  ///< of its bytes
  std::string_view bytes;
};

std::span<const PageFile> page_files();

}  // namespace treeroll::web
