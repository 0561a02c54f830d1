#include "workers/app/host_facts.h"

#include <gnu/libc-version.h>
#include <sys/utsname.h>

#include "common/base/check.h"
#include "common/numbers/elementary.h"

namespace treeroll::worker {

std::string numeric_class() {
  utsname names{};
  CHECK(uname(&names) == 0, "uname");
  std::string text = names.machine;
#if defined(__x86_64__)
  if (__builtin_cpu_supports("fma")) text += " fma";
  if (__builtin_cpu_supports("avx2")) text += " avx2";
#endif
  return text + " glibc " + gnu_get_libc_version() + " elementary " +
         std::to_string(elementary::kVersion);
}

}  // namespace treeroll::worker
