#pragma once

#include "common/numbers/elementary_kernels.h"
#include "common/numbers/lanes.h"

/// Gaussian mixture regression for one input, as a kernel over lanes (common/numbers/lanes.h): V is
/// one double, or a vector of them with an input a lane.
namespace treeroll::gmr_kernel {

/// A mixture of one input, ready for and; K components whose prior is not zero, dO
/// outputs. Plain memory, as sources of lanes see it.
struct Lines {
  int num_components;
  int output_dim;
  const double* mean_input;   ///< K
  const double* precision;    ///< K, 1 / standard deviation of the input
  const double* log_weight;   ///< K, log(pi_k) - log(deviation)
  const double* slope;        ///< K x dO, a component a row
  const double* mean_output;  ///< K x dO
};

/// The mean of the outputs, (A-9), by log-sum-exp.
/// @param input    an input a lane, within +-kGmmMagnitudeMax
/// @param weights  work space of K numbers a lane
/// @param take     take(o, V): receives each output
template <class V, class Take>
TREEROLL_LANE_INLINE void regress(const Lines& lines, V input, double* weights, Take&& take) {
  constexpr int kWidth = lanes::kWidth<V>;
  V largest = lanes::all<V>(-1. / 0.);
  for (int k = 0; k < lines.num_components; ++k) {
    const V distance = (input - lines.mean_input[k]) * lines.precision[k];
    const V log_density = lines.log_weight[k] - .5 * distance * distance;
    lanes::store(log_density, weights + k * kWidth);
    largest = lanes::larger(largest, log_density);
  }
  V sum = V{};
  for (int k = 0; k < lines.num_components; ++k) {
    const V weight = elementary::kernel::exp<V>(lanes::load<V>(weights + k * kWidth) - largest);
    lanes::store(weight, weights + k * kWidth);
    sum += weight;
  }
  for (int o = 0; o < lines.output_dim; ++o) {
    V output = V{};
    for (int k = 0; k < lines.num_components; ++k) {
      const int at = k * lines.output_dim + o;
      output += lanes::load<V>(weights + k * kWidth) *
                (lines.mean_output[at] + lines.slope[at] * (input - lines.mean_input[k]));
    }
    take(o, output / sum);
  }
}

}  // namespace treeroll::gmr_kernel
