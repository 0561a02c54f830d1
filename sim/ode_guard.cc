#include "sim/ode_guard.h"

#include <fmt/format.h>
#include <ode/ode.h>

#include <array>
#include <csetjmp>
#include <cstdarg>
#include <cstdio>

namespace treeroll::sim {
namespace {

/// What ODE said during the guarded call of this thread; plain memory, as handlers may be left by
/// longjmp.
struct Report {
  bool armed = false;
  bool received = false;
  int number = 0;
  std::array<char, 200> text{};
  std::jmp_buf way_out{};
};
thread_local Report report;

void keep(int number, const char* format, va_list arguments) {
  if (report.received) return;  // the first one is nearest to the cause
  report.received = true;
  report.number = number;
  std::vsnprintf(report.text.data(), report.text.size(), format, arguments);
}

extern "C" void on_ode_message(int number, const char* format, va_list arguments) {
  keep(number, format, arguments);
}

/// ODE calls exit or abort when this returns.
extern "C" void on_ode_error(int number, const char* format, va_list arguments) {
  keep(number, format, arguments);
  if (report.armed) std::longjmp(report.way_out, 1);
  std::fprintf(stderr, "ODE error %d outside a guard: %s\n", number, report.text.data());
}

bool initialise() {
  dSetMessageHandler(&on_ode_message);
  dSetErrorHandler(&on_ode_error);
  dSetDebugHandler(&on_ode_error);
  return dInitODE2(0) != 0;
}

}  // namespace

void initialise_ode() {
  static const bool initialised = initialise();
  CHECK(initialised, "ODE could not be initialised");
}

std::optional<Error> run_ode_guarded(void (*work)(void* context), void* context) {
  CHECK(!report.armed, "a guard within a guard");
  report.received = false;
  report.armed = true;
  if (setjmp(report.way_out) == 0) work(context);
  report.armed = false;
  if (!report.received) return std::nullopt;
  return Error{fmt::format("ODE reported {}: {}", report.number, report.text.data())};
}

}  // namespace treeroll::sim
