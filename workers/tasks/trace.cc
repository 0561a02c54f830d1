#include "workers/tasks/trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "common/base/check.h"

namespace treeroll {

void Trace::set_columns(std::vector<std::string> names) {
  CHECK(columns_.empty() && !names.empty(), "the columns of a trace are named once");
  columns_ = std::move(names);
}

void Trace::set_policy_columns(std::vector<std::string> inputs, std::vector<std::string> outputs) {
  for (const auto* names : {&inputs, &outputs}) {
    for (const std::string& name : *names) {
      CHECK(std::find(columns_.begin(), columns_.end(), name) != columns_.end(),
            "what a policy takes and gives are columns of the trace");
    }
  }
  policy_inputs_ = std::move(inputs);
  policy_outputs_ = std::move(outputs);
}

bool Trace::has_room_for(std::size_t num_numbers) {
  if (num_kept_ + num_numbers > kNumbersMax) is_complete_ = false;
  if (is_complete_) num_kept_ += num_numbers;
  return is_complete_;
}

void Trace::add_row(std::initializer_list<double> numbers) {
  add_row(std::span(numbers.begin(), numbers.size()));
}

void Trace::add_row(std::span<const double> numbers) {
  CHECK(!columns_.empty() && numbers.size() == columns_.size(),
        "a row of a trace has a number for each column");
  if (!keeps_rows()) return;
  if (has_room_for(numbers.size())) numbers_.insert(numbers_.end(), numbers.begin(), numbers.end());
}

void Trace::set_term(const std::string& name, double number) {
  if (name.empty() || name.size() > kTermNameBytesMax) {
    throw std::invalid_argument(fmt::format("the name of a term has {} bytes, must have 1 to {}",
                                            name.size(), kTermNameBytesMax));
  }
  if (terms_.size() == kTermsMax && !terms_.contains(name)) {
    throw std::invalid_argument(fmt::format("a reward must have at most {} terms", kTermsMax));
  }
  terms_[name] = number;
}

void Trace::add_pose(Pose pose) {
  if (!keeps_rows()) return;
  std::size_t num_numbers = 0;
  for (const auto& line : pose) num_numbers += 2 * line.size();
  if (!has_room_for(num_numbers)) return;
  poses_.push_back(std::move(pose));
  CHECK(poses_.size() * columns_.size() == numbers_.size(), "every row has a pose, or none has");
}

}  // namespace treeroll
