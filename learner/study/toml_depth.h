#pragma once

#include <cstddef>
#include <string_view>

namespace treeroll {

/// Deepest nesting of tables and arrays that is accepted.
inline constexpr int kTomlDepthMax = 32;

/// Line (from 1) of the first dotted key with more than kTomlDepthMax parts or the first bracket
/// nested deeper than that, 0 if there is none. toml++ bounds brackets but not dotted keys: a
/// megabyte of "a.a.a..." would overflow the stack when the document is destroyed.
int first_line_too_deep(std::string_view toml);

/// Bytes of the text but for what its multi-line strings hold: what a parser makes nodes of.
std::size_t bytes_beside_long_strings(std::string_view toml);

}  // namespace treeroll
