#pragma once

#include <string>

namespace treeroll::sim {

/// Eight hexadecimal digits of what ODE makes of one fixed motion here, bit for bit: two seconds of
/// a double pendulum that is thrown about, every state of it. Hosts whose libraries step alike have
/// the same; whose processor or build of ODE differs in any last bit has another. Takes some
/// milliseconds.
std::string ode_canary();

}  // namespace treeroll::sim
