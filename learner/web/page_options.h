#pragma once

#include <filesystem>
#include <string>

namespace treeroll::web {

/// --http and --http-token-file of a program.
struct PageOptions {
  std::string address;  ///< "[ADDRESS:]PORT"; empty: no page
  std::filesystem::path token_file;
};

}  // namespace treeroll::web
