#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/settings/settings_reader.h"

namespace treeroll {

bool obeys(double number, NumberRule rule);
/// As an error has it.
std::string rule_text(NumberRule rule);
/// As the reference has it; empty: any.
std::string bounds_text(NumberRule rule);
/// A number within a rule, as JSON.
std::string example_number(NumberRule rule);
/// A list of them, each larger than the one before as far as the rule lets it.
std::string example_numbers(NumberRule rule, std::size_t count);

/// A fallback as JSON; empty: there is none.
std::string default_text(const std::optional<double>& fallback);
std::string default_text(const std::optional<std::int64_t>& fallback);
std::string default_text(const std::optional<bool>& fallback);
std::string default_text(const std::optional<std::string>& fallback);
std::string default_text(const std::optional<std::vector<double>>& fallback);
std::string default_text(const std::optional<std::vector<std::vector<double>>>& fallback);

}  // namespace treeroll
