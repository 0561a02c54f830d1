#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "common/base/config_error.h"

namespace treeroll {

/// Does what a full disk, say, may end: everything that was learnt is in the journal then.
template <class Action>
void do_resumably(const std::filesystem::path& directory, const Action& action) {
  try {
    action();
  } catch (const BadInput&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(std::string(error.what()) +
                             "; what is in the journal is kept, go on with --resume " +
                             directory.string());
  }
}

}  // namespace treeroll
