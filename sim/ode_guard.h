#pragma once

#include <optional>
#include <type_traits>

#include "common/base/result.h"

namespace treeroll::sim {

/// Initialises Open Dynamics Engine, once a process, and takes over its three report handlers,
/// which by default print and, for errors, end the process.
void initialise_ode();

/// Runs calls to ODE and turns whatever ODE reports during them into an error. After a message (the
/// solver had numeric trouble) `work` has run to its end. After an error or a debug report it was
/// left in the middle by longjmp, as ODE ends the process when such a handler returns: the world
/// worked on must not be used or destroyed any more. Hence `work` must only call ODE: no callbacks
/// of others, no objects with destructors. Guards do not nest.
std::optional<Error> run_ode_guarded(void (*work)(void* context), void* context);

template <class Work>
std::optional<Error> run_ode_guarded(Work&& work) {
  using WorkType = std::remove_reference_t<Work>;
  return run_ode_guarded([](void* context) { (*static_cast<WorkType*>(context))(); }, &work);
}

}  // namespace treeroll::sim
