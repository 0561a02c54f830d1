#include "common/numbers/elementary.h"

#include <cmath>

#include "common/numbers/elementary_kernels.h"

// The header warns by the thousand and leaks macros: this is the only file that includes it.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wignored-attributes"
#include <sleef.h>
#pragma GCC diagnostic pop

namespace treeroll::elementary {

SinCos sin_cos(double x) {
  // Written so that NaN goes the other way too.
  if (!(std::abs(x) <= kSinCosMax)) {
    return {Sleef_cinz_sind1_u10purec(x), Sleef_cinz_cosd1_u10purec(x)};
  }
  SinCos both{};
  kernel::sin_cos(x, both.sin, both.cos);
  return both;
}

double sin(double x) { return sin_cos(x).sin; }
double cos(double x) { return sin_cos(x).cos; }
double exp(double x) { return kernel::exp(x); }
double log(double x) { return Sleef_cinz_logd1_u10purec(x); }
double atan2(double y, double x) { return Sleef_cinz_atan2d1_u10purec(y, x); }

}  // namespace treeroll::elementary
