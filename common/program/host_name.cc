#include "common/program/host_name.h"

#include <sys/utsname.h>

#include "common/base/check.h"

namespace treeroll {

std::string host_name() {
  utsname names{};
  CHECK(uname(&names) == 0, "uname");
  return readable(names.nodename);
}

std::string readable(std::string_view name) {
  std::string text;
  for (const char c : name) text += c > ' ' && c <= '~' ? c : '?';
  return text;
}

}  // namespace treeroll
