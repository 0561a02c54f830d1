#include "common/base/signal_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "common/base/cut_text.h"
#include "common/base/for_log.h"

namespace treeroll {
namespace {

constexpr std::size_t kListBytesMax = 120;

/// They stand in JSON, in tables, on axes and in logs as they are, also those of strangers.
bool is_signal_name(const std::string& name) {
  const auto is_kept = [](unsigned char c) {
    return c > ' ' && c != 0x7f && c != '"' && c != '\\' && c != ',';
  };
  return !name.empty() && name.size() <= kSignalNameBytesMax &&
         std::ranges::all_of(name, is_kept) && for_log(name) == name;
}

std::optional<std::string> fault_of_list(const char* what, const std::vector<std::string>& names,
                                         int dim) {
  if (names.size() != static_cast<std::size_t>(dim)) {
    return fmt::format("{}: has {} names, must have {}", what, names.size(), dim);
  }
  const auto bad = std::ranges::find_if_not(names, is_signal_name);
  if (bad != names.end()) {
    return fmt::format(
        "{}: the name '{}' must have from 1 to {} bytes of UTF-8, without blanks, control "
        "characters, commas, quotes and backslashes",
        what, for_log(cut_text(*bad, kSignalNameBytesMax)), kSignalNameBytesMax);
  }
  if (std::set(names.begin(), names.end()).size() != names.size()) {
    return fmt::format("{}: each name must be there once", what);
  }
  return std::nullopt;
}

std::string listed(const std::vector<std::string>& names) {
  return cut_text(fmt::format("{}", fmt::join(names, ", ")), kListBytesMax);
}

}  // namespace

std::optional<std::string> fault_of(const SignalNames& names, int input_dim, int output_dim) {
  if (names.empty()) return std::nullopt;
  if (auto fault = fault_of_list("inputs", names.inputs, input_dim)) return fault;
  return fault_of_list("outputs", names.outputs, output_dim);
}

std::optional<std::string> difference(const SignalNames& names, const std::string& others_are,
                                      const SignalNames& others) {
  if (names.empty() || others.empty() || names == others) return std::nullopt;
  const bool differs_in = names.inputs != others.inputs;
  return fmt::format("{} are {}, {} {}", differs_in ? "inputs" : "outputs",
                     listed(differs_in ? names.inputs : names.outputs), others_are,
                     listed(differs_in ? others.inputs : others.outputs));
}

std::vector<std::string> all_of(const SignalNames& names) {
  std::vector<std::string> all = names.inputs;
  all.insert(all.end(), names.outputs.begin(), names.outputs.end());
  return all;
}

}  // namespace treeroll
