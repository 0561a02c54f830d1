#pragma once

namespace treeroll {

/// Mean over time of what is seen at the output steps, by the trapezoidal rule.
class TimeMean {
 public:
  void see(double time_s, double value) {
    if (is_first_)
      start_s_ = time_s;
    else
      integral_ += (time_s - last_s_) * (value + last_value_) / 2;
    is_first_ = false;
    last_s_ = time_s;
    last_value_ = value;
  }
  double mean() const {
    return last_s_ > start_s_ ? integral_ / (last_s_ - start_s_) : last_value_;
  }

 private:
  bool is_first_ = true;
  double start_s_ = 0, last_s_ = 0, last_value_ = 0, integral_ = 0;
};

}  // namespace treeroll
