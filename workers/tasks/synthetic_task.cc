#include "workers/tasks/synthetic_task.h"

#include <time.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <csignal>
#include <limits>
#include <span>
#include <thread>

#include "common/base/check.h"
#include "common/base/content_hash.h"
#include "common/base/elementary.h"
#include "common/base/random_stream.h"
#include "common/base/settings_reader.h"
#include "workers/tasks/setting_rules.h"

namespace treeroll {
namespace {

constexpr int kDimMax = 64;
constexpr NumberRule kFailureFraction{.min = 0, .max = 1};
constexpr std::int64_t kDurationMaxUs = std::int64_t{3600} * 1'000'000;
constexpr std::int64_t kForEver = std::numeric_limits<std::int64_t>::max();

/// Processor time, not time on the clock: two evaluators that share a core take twice as long, as
/// two simulations would.
std::int64_t processor_time_us() {
  timespec now{};
  CHECK(clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now) == 0, "no clock of processor time");
  return std::int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
}

/// A number in [0, 1) that depends on every bit of the mixture, and on nothing else.
double uniform_of(const Gmm& policy) {
  std::vector<double> numbers;
  for (const Component& component : policy.components()) {
    numbers.push_back(component.prior);
    numbers.insert(numbers.end(), component.mean.begin(), component.mean.end());
    const auto covariance = component.covariance.reshaped();
    numbers.insert(numbers.end(), covariance.begin(), covariance.end());
  }
  const ContentHash hash = content_hash(std::as_bytes(std::span<const double>(numbers)));
  const auto bits = static_cast<std::uint64_t>(short_form(hash));
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

}  // namespace

SyntheticTask::SyntheticTask(SettingsReader& settings)
    : input_dim_(static_cast<int>(settings.integer("input_dim", 1, kDimMax, 1))),
      output_dim_(static_cast<int>(settings.integer("output_dim", 1, kDimMax, 1))),
      sensitivity_(settings.number("sensitivity", kPositive, 1)),
      duration_us_(settings.integer("duration_us", 0, kDurationMaxUs, 0)),
      mode_(settings.choice("mode", {"burn", "sleep"}, "burn") == "burn" ? Mode::kBurn
                                                                         : Mode::kSleep),
      fail_fraction_(settings.number("fail_fraction", kFailureFraction, 0)),
      hang_fraction_(settings.number("hang_fraction", kFailureFraction, 0)),
      crash_fraction_(settings.number("crash_fraction", kFailureFraction, 0)),
      noise_deviation_(settings.number("noise_deviation", kFailureFraction, 0)),
      time_limit_s_(settings.number("time_limit_s", kTimeLimit, 10)) {
  const std::size_t target_size = input_dim_ + output_dim_ + input_dim_ * output_dim_;
  target_ = settings.numbers("target", kAnyNumber, target_size, target_size,
                             std::vector<double>(target_size, 1.));
  if (fail_fraction_ + hang_fraction_ + crash_fraction_ > 1) {
    settings.refuse("fail_fraction", "must be at most 1 together with the other fractions");
  }
}

TaskDescription SyntheticTask::description() const {
  return {.input_dim = input_dim_,
          .output_dim = output_dim_,
          .reward_min = 0,
          .reward_max = 1,
          .time_limit_s = time_limit_s_,
          .deterministic = noise_deviation_ == 0};
}

Evaluation SyntheticTask::evaluate(const Gmm& policy, std::uint64_t seed) {
  CHECK(policy.input_dim() == input_dim_ && policy.output_dim() == output_dim_,
        "a policy with the dimensions of the description");
  spend(duration_us_);
  switch (fate(policy)) {
    case Fate::kReward:
      break;
    case Fate::kFail:
      return {.reward = 0, .status = RolloutStatus::kFailed};
    case Fate::kHang:
      spend(kForEver);
      break;
    case Fate::kCrash:
      std::signal(SIGSEGV, SIG_DFL);  // a handler, such as a sanitizer's, would not crash
      std::raise(SIGSEGV);
  }
  double noise = 0;
  if (noise_deviation_ > 0) {
    noise = noise_deviation_ * RandomStream(seed, 0, 0, RandomPurpose::kTaskSeed).next_normal();
  }
  return {.reward = std::clamp(reward(policy) + noise, 0., 1.)};
}

SyntheticTask::Fate SyntheticTask::fate(const Gmm& policy) const {
  const double uniform = uniform_of(policy);
  if (uniform < fail_fraction_) return Fate::kFail;
  if (uniform < fail_fraction_ + hang_fraction_) return Fate::kHang;
  if (uniform < fail_fraction_ + hang_fraction_ + crash_fraction_) return Fate::kCrash;
  return Fate::kReward;
}

double SyntheticTask::reward(const Gmm& policy) const {
  double sum = 0;
  for (const Component& component : policy.components()) {
    const Eigen::MatrixXd input = component.covariance.topLeftCorner(input_dim_, input_dim_);
    const Eigen::MatrixXd cross = component.covariance.topRightCorner(input_dim_, output_dim_);
    const Eigen::MatrixXd slope = input.llt().solve(cross);  // column o: output o over the inputs
    Eigen::VectorXd numbers(static_cast<Eigen::Index>(target_.size()));
    numbers << component.mean, slope.reshaped();
    sum +=
        (numbers - Eigen::Map<const Eigen::VectorXd>(target_.data(), numbers.size())).squaredNorm();
  }
  const auto count = static_cast<double>(policy.num_components() * target_.size());
  return elementary::exp(-sensitivity_ * sum / count);
}

void SyntheticTask::spend(std::int64_t duration_us) const {
  if (duration_us == 0) return;
  if (mode_ == Mode::kBurn) {
    const std::int64_t start_us = processor_time_us();
    while (processor_time_us() - start_us < duration_us) {
    }
    return;
  }
  const auto one_hour = std::chrono::microseconds(kDurationMaxUs);
  while (duration_us == kForEver) std::this_thread::sleep_for(one_hour);
  std::this_thread::sleep_for(std::chrono::microseconds(duration_us));
}

}  // namespace treeroll
