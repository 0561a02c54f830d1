#pragma once

#include <stdexcept>

namespace treeroll {

/// What a person gave cannot be used: what() says so in one line. Programs end with status 2.
class BadInput : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace treeroll
