// libFuzzer's entry: TREEROLL_FUZZ_TARGET names the target.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "tests/fuzz/target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const treeroll::fuzz::Target& target = [] {
    const char* name = std::getenv("TREEROLL_FUZZ_TARGET");
    return std::cref(treeroll::fuzz::target(name != nullptr ? name : ""));
  }();
  target.run({reinterpret_cast<const char*>(data), size});
  return 0;
}
