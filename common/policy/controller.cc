#include "common/policy/controller.h"

#include "common/base/check.h"

namespace treeroll {

void Controller::act_all(std::span<const double> inputs, std::span<double> outputs) {
  const auto num_in = static_cast<std::size_t>(input_dim());
  const auto num_out = static_cast<std::size_t>(output_dim());
  CHECK(inputs.size() / num_in == outputs.size() / num_out, "an output for each input");
  for (std::size_t i = 0; i < inputs.size() / num_in; ++i) {
    act(inputs.subspan(i * num_in, num_in), outputs.subspan(i * num_out, num_out));
  }
}

}  // namespace treeroll
