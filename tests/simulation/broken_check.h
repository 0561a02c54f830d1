#pragma once

#include <stdexcept>

namespace treeroll::simulation {

/// A CHECK that failed. In programs with broken_check.cc it is thrown where it ends others, so that
/// the seed can be told.
struct BrokenCheck : std::logic_error {
  using std::logic_error::logic_error;
};

}  // namespace treeroll::simulation
