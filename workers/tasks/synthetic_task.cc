#include "workers/tasks/synthetic_task.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <limits>
#include <span>
#include <thread>

#include "common/base/check.h"
#include "common/base/content_hash.h"
#include "common/numbers/elementary.h"
#include "common/numbers/random_stream.h"
#include "common/settings/settings_reader.h"
#include "workers/tasks/setting_rules.h"

namespace treeroll {
namespace {

constexpr int kDimMax = 64;
constexpr NumberRule kFailureFraction{.min = 0, .max = 1};
/// Where the policy is asked, along each input from the target's.
constexpr double kProbeOffsets[] = {-1, -.5, 0, .5, 1};
constexpr std::int64_t kDurationMaxUs = std::int64_t{3600} * 1'000'000;
constexpr std::int64_t kForEver = std::numeric_limits<std::int64_t>::max();

/// Processor time, not time on the clock: two evaluators that share a core take twice as long, as
/// two simulations would.
std::int64_t processor_time_us() {
  timespec now{};
  CHECK(clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now) == 0, "no clock of processor time");
  return std::int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
}

/// A number in [0, 1) that depends on every bit of the outputs, and on nothing else.
double uniform_of(const std::vector<double>& outputs) {
  const ContentHash hash = content_hash(std::as_bytes(std::span(outputs)));
  const auto bits = static_cast<std::uint64_t>(short_form(hash));
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

}  // namespace

SyntheticTask::SyntheticTask(SettingsReader& settings)
    : input_dim_(static_cast<int>(
          settings.integer("input_dim", 1, kDimMax, 1, {.meaning = "Inputs of the policy"}))),
      output_dim_(static_cast<int>(
          settings.integer("output_dim", 1, kDimMax, 1, {.meaning = "Outputs of the policy"}))),
      sensitivity_(settings.number(
          "sensitivity", kPositive, 1,
          {.meaning =
               "Of the reward exp(-sensitivity mean squared distance to the target's line)"})),
      duration_us_(settings.integer("duration_us", 0, kDurationMaxUs, 0,
                                    {.meaning = "Of each evaluation", .unit = "us"})),
      mode_(settings.choice(
                "mode", {"burn", "sleep"}, "burn",
                {.meaning = "What an evaluation takes: processor time, or time on the clock"}) ==
                    "burn"
                ? Mode::kBurn
                : Mode::kSleep),
      fail_fraction_(settings.number("fail_fraction", kFailureFraction, 0,
                                     {.meaning = "Share of policies that fail"})),
      hang_fraction_(settings.number("hang_fraction", kFailureFraction, 0,
                                     {.meaning = "Share of policies that are never answered"})),
      crash_fraction_(
          settings.number("crash_fraction", kFailureFraction, 0,
                          {.meaning = "Share of policies that end the process by SIGSEGV; at most "
                                      "1 together with the other two"})),
      discard_fraction_(
          settings.number("discard_fraction", kFailureFraction, 0,
                          {.meaning = "Share of trials that are void, drawn from the seed"})),
      noise_deviation_(settings.number(
          "noise_deviation", kFailureFraction, 0,
          {.meaning = "Standard deviation of noise on the reward, drawn from the seed"})),
      time_limit_s_(read_time_limit_s(settings)) {
  const std::size_t target_size = input_dim_ + output_dim_ + input_dim_ * output_dim_;
  target_ = settings.numbers(
      "target", kAnyNumber, target_size, target_size, std::vector<double>(target_size, 1.),
      {.meaning = "Of the line: an input, its outputs, and its slope, row by row",
       .otherwise = "all 1",
       .rule = "inputs + outputs + inputs x outputs numbers"});
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

Outcome SyntheticTask::evaluate(Controller& controller, std::uint64_t seed) {
  CHECK(controller.input_dim() == input_dim_ && controller.output_dim() == output_dim_,
        "a controller with the dimensions of the description");
  spend(duration_us_);
  if (discard_fraction_ > 0 &&
      RandomStream(seed, 1, 0, RandomPurpose::kTaskSeed).next_uniform() < discard_fraction_) {
    return Outcome::discarded("its seed is one of discard_fraction");
  }
  const std::vector<double> outputs = ask(controller);
  switch (fate(outputs)) {
    case Fate::kReward:
      break;
    case Fate::kFail:
      return Outcome::failed(RolloutStatus::kFailed, "its policy is one of fail_fraction");
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
  return Outcome::ok(std::clamp(reward(outputs) + noise, 0., 1.));
}

SyntheticTask::Fate SyntheticTask::fate(const std::vector<double>& outputs) const {
  const double uniform = uniform_of(outputs);
  if (uniform < fail_fraction_) return Fate::kFail;
  if (uniform < fail_fraction_ + hang_fraction_) return Fate::kHang;
  if (uniform < fail_fraction_ + hang_fraction_ + crash_fraction_) return Fate::kCrash;
  return Fate::kReward;
}

std::vector<double> SyntheticTask::probes() const {
  const auto num_inputs = static_cast<std::size_t>(input_dim_);
  std::vector<double> inputs;
  for (std::size_t axis = 0; axis < num_inputs; ++axis) {
    for (const double offset : kProbeOffsets) {
      inputs.insert(inputs.end(), target_.begin(), target_.begin() + input_dim_);
      inputs[inputs.size() - num_inputs + axis] += offset;
    }
  }
  return inputs;
}

std::vector<double> SyntheticTask::ask(Controller& controller) const {
  const auto num_inputs = static_cast<std::size_t>(input_dim_);
  const auto num_outputs = static_cast<std::size_t>(output_dim_);
  const std::vector<double> inputs = probes();
  const std::size_t num_probes = inputs.size() / num_inputs;
  std::vector<double> outputs(num_probes * num_outputs);
  controller.start();
  for (std::size_t i = 0; i < num_probes; ++i) {
    controller.act(std::span(inputs).subspan(i * num_inputs, num_inputs),
                   std::span(outputs).subspan(i * num_outputs, num_outputs));
  }
  return outputs;
}

double SyntheticTask::reward(const std::vector<double>& outputs) const {
  const auto num_inputs = static_cast<std::size_t>(input_dim_);
  const auto num_outputs = static_cast<std::size_t>(output_dim_);
  const std::span<const double> target(target_);
  const std::span<const double> slope = target.subspan(num_inputs + num_outputs);
  const std::vector<double> inputs = probes();
  double sum = 0;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const std::size_t probe = i / num_outputs;
    const std::size_t output = i % num_outputs;
    double line = target[num_inputs + output];
    for (std::size_t input = 0; input < num_inputs; ++input) {
      line +=
          slope[output * num_inputs + input] * (inputs[probe * num_inputs + input] - target[input]);
    }
    sum += (outputs[i] - line) * (outputs[i] - line);
  }
  return elementary::exp(-sensitivity_ * sum / static_cast<double>(outputs.size()));
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
