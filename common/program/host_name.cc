#include "common/program/host_name.h"

#include <sys/utsname.h>

#include "common/base/check.h"

namespace treeroll {

std::string host_name() {
  utsname names{};
  CHECK(uname(&names) == 0, "uname");
  return names.nodename;
}

}  // namespace treeroll
