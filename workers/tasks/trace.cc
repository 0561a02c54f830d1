#include "workers/tasks/trace.h"

#include <utility>

#include "common/base/check.h"

namespace treeroll {

void Trace::set_columns(std::vector<std::string> names) {
  CHECK(columns_.empty() && !names.empty(), "the columns of a trace are named once");
  columns_ = std::move(names);
}

void Trace::add_row(std::initializer_list<double> numbers) {
  CHECK(!columns_.empty() && numbers.size() == columns_.size(),
        "a row of a trace has a number for each column");
  if (numbers_.size() + numbers.size() > kNumbersMax) is_complete_ = false;
  if (is_complete_) numbers_.insert(numbers_.end(), numbers);
}

}  // namespace treeroll
