#pragma once

#include <vector>

#include "common/policy/linear/basis.h"

namespace treeroll {

/// Normalised radial functions over [low, high]: phi_i = exp(-(t - c_i)^2 / (2 w^2)) / sum, centres
/// equally spaced from end to end, w the space between them. They sum to 1.
class RadialBasis final : public Basis {
 public:
  /// Precondition: size >= 2, low < high.
  RadialBasis(int size, double low, double high);

  int size() const override { return static_cast<int>(centres_.size()); }
  double low() const override { return centres_.front(); }
  double high() const override { return centres_.back(); }
  int num_at_once() const override { return size(); }
  int values(double input, std::span<double> values) const override;

 private:
  std::vector<double> centres_;
  double width_;
};

}  // namespace treeroll
