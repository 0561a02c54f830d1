#pragma once

#include <compare>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace treeroll {

inline constexpr std::size_t kSignalsMax = 1024;  ///< inputs or outputs
inline constexpr std::size_t kSignalNameBytesMax = 128;

/// What a task calls the inputs and outputs of its policies: each a name with its unit last, as a
/// column of a trace has it ("time_s", "cart_acceleration_mps2"). They are for people and for
/// programs that act by name, and decide no bit: neither messages to workers nor hashes hold them.
/// Workers report theirs, so a learner that has no such task itself has them too.
struct SignalNames {
  std::vector<std::string> inputs = {};
  std::vector<std::string> outputs = {};

  /// Nobody has named them.
  bool empty() const { return inputs.empty() && outputs.empty(); }
  auto operator<=>(const SignalNames&) const = default;
};

/// What is wrong with names of so many inputs and outputs: "inputs: must name each of 2". Nothing
/// for those that are right, and for none at all.
std::optional<std::string> fault_of(const SignalNames& names, int input_dim, int output_dim);

/// Why two that should name the same signals do not: "inputs are t_s, here they are time_s".
/// Nothing where they agree, or where one of them names none.
/// @param others_are  "here they are"
std::optional<std::string> difference(const SignalNames& names, const std::string& others_are,
                                      const SignalNames& others);

/// Inputs, then outputs.
std::vector<std::string> all_of(const SignalNames& names);

}  // namespace treeroll
