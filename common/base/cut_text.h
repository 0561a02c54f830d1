#pragma once

#include <cstddef>
#include <string>

namespace treeroll {

/// The first bytes of a text, at most `bytes_max`; of a UTF-8 character all bytes or none.
std::string cut_text(std::string text, std::size_t bytes_max);

}  // namespace treeroll
