#pragma once

#include <string_view>

namespace treeroll {

/// What the reference of settings says of a key, beside what the question itself says: its type,
/// default and bounds. It stands where the key is read, so that neither can be forgotten.
///
///   settings.number("step_s", kStep, 1e-3, {.meaning = "of the simulation", .unit = "s"})
struct KeyHelp {
  std::string_view meaning = {};
  std::string_view unit = {};
  std::string_view otherwise = {};  ///< the default in words, where it follows from other settings
  std::string_view rule = {};       ///< the bounds in words, where they do
  /// JSON. What the reference goes on with where the key has no default, and shows.
  std::string_view example = {};
};

}  // namespace treeroll
