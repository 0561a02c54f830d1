#include "tests/fuzz/target.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "common/base/config_error.h"
#include "common/policy/kinds/standard_policies.h"
#include "common/policy/policy.h"
#include "common/task_facts/task_description.h"
#include "common/transport/channel.h"
#include "common/transport/codec.h"
#include "common/transport/short_frame.h"
#include "learner/fit/csv_demonstration.h"
#include "learner/fit/csv_rows.h"
#include "learner/journal/journal_file.h"
#include "learner/report/claims_file.h"
#include "learner/study/study_document.h"
#include "learner/web/http_text.h"
#include "workers/tasks/trace.h"
#include "workers/user_program/evaluator_lines.h"

namespace treeroll::fuzz {
namespace {

std::span<const std::byte> as_bytes(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

bool refused(const std::string& why) {
  require(!why.empty(), "a refusal says why");
  return false;
}

/// Errors of ours are answers.
template <class Read>
bool may_refuse(const Read& read) {
  try {
    read();
    return true;
  } catch (const BadInput& refusal) {
    return refused(refusal.what());
  }
}

/// First byte: the channel.
bool read_message(std::string_view bytes) {
  if (bytes.empty()) return false;
  const auto channel = static_cast<transport::Channel>(static_cast<unsigned char>(bytes.front()) %
                                                       transport::kNumChannels);
  const auto message = transport::decode(channel, as_bytes(bytes.substr(1)));
  if (!message) return refused(message.error().message);
  const std::vector<std::byte> again = transport::encode(*message);
  // But for the signatures to the workers that a batch names: messages do not hold them.
  constexpr std::size_t kWordBytes = 16;
  require(again.size() < bytes.size() && (bytes.size() - 1 - again.size()) % kWordBytes == 0,
          "a message is as long as what it was read from");
  require(static_cast<bool>(transport::decode(channel, again)), "what is written is read");
  return true;
}

bool read_datagram(std::string_view bytes) {
  const auto frame = transport::read_short_frame(as_bytes(bytes));
  if (frame) require(frame->payload.size() < bytes.size(), "a payload is a part of its datagram");
  return frame.has_value();
}

bool read_journal_bytes(std::string_view bytes) {
  std::istringstream stream{std::string(bytes)};
  std::uint64_t end = 0;
  try {
    const auto tail = read_journal_places(
        stream, "journal", [&](const JournalRecord& record, const RecordPlace& place) {
          require(place.begin >= end && place.end > place.begin, "records stand in order");
          end = place.end;
          std::uint64_t check = 0;
          require(static_cast<bool>(unframe(frame(record, place.number, 0, 0, check))),
                  "what is written is read");
        });
    return tail ? true : refused(tail.error().message);
  } catch (const std::runtime_error& later_form) {
    return refused(later_form.what());
  }
}

bool read_policy(std::string_view bytes) {
  static const PolicyRegistry kinds = standard_policies();
  const Result<PolicyPtr> policy = kinds.from_json(bytes);
  if (!policy) return refused(policy.error().message);
  const std::string text = to_json(**policy);
  const Result<PolicyPtr> again = kinds.from_json(text);
  require(static_cast<bool>(again) && to_json(**again) == text, "what is written is read");
  const std::unique_ptr<Controller> controller = (*policy)->controller();
  const std::vector<double> input(static_cast<std::size_t>(controller->input_dim()), 0.5);
  std::vector<double> output(static_cast<std::size_t>(controller->output_dim()));
  controller->start();
  try {
    controller->act(input, output);
  } catch (const std::runtime_error& error) {
    require(std::string_view(error.what()).ends_with("(policy.bounds)"), "bounds alone refuse");
    return refused(error.what());
  }
  return true;
}

bool read_demonstration(std::string_view bytes) {
  const bool is_taken = may_refuse([&] {
    const Eigen::MatrixXd data = parse_demonstration(bytes, "demo.csv", {"t", "x"}, 1);
    require(data.rows() == 2 && data.row(0).allFinite(), "times are numbers");
  });
  may_refuse([&] {
    CsvRows rows(bytes, "demo.csv");
    while (rows.next()) require(!rows.fields().empty(), "a row has fields");
  });
  return is_taken;
}

bool read_study(std::string_view bytes) {
  const std::string path = as_file(bytes);
  return may_refuse([&] {
    const StudyDocument document(path, {});
    for (std::size_t i = 0; i < document.num_conditions(); ++i) {
      nlohmann::json settings;
      document.settings(i, settings);
      require(settings.is_object(), "settings are tables");
    }
  });
}

bool read_claims_file(std::string_view bytes) {
  const std::string path = as_file(bytes);
  return may_refuse([&] { report::read_claims(path); });
}

bool read_answers(std::string_view bytes) {
  const auto description = worker::read_describe_answer(bytes);
  if (!description) refused(description.error().message);
  worker::is_answer(bytes);
  static const TaskDescription task{
      .input_dim = 1, .output_dim = 1, .reward_min = 0, .reward_max = 1, .time_limit_s = 1};
  Trace trace;
  const worker::EvaluateAnswer answer = worker::read_evaluate_answer(bytes, task, &trace);
  require(!answer.outcome.is_ok() || task.is_in_range(answer.outcome.reward()),
          "a reward is one that the task may give");
  return answer.outcome.is_ok();
}

bool read_http(std::string_view bytes) {
  std::string input(bytes);
  for (int i = 0; i < 100; ++i) {
    const std::size_t before = input.size();
    const web::ReadRequest read = web::read_request(input, 8192);
    if (!std::holds_alternative<web::HttpRequest>(read)) return i > 0;
    require(input.size() < before, "a request is taken out");
    require(std::get<web::HttpRequest>(read).path.starts_with('/'), "a path begins with a slash");
  }
  return true;
}

constexpr Target kTargets[] = {
    {"claims", read_claims_file},
    {"datagram", read_datagram},
    {"demonstration", read_demonstration},
    {"evaluator", read_answers},
    {"http", read_http},
    {"journal", read_journal_bytes},
    {"message", read_message},
    {"policy", read_policy},
    {"study", read_study},
};

}  // namespace

std::span<const Target> targets() { return kTargets; }

const Target& target(std::string_view name) {
  for (const Target& one : kTargets) {
    if (one.name == name) return one;
  }
  std::fprintf(stderr, "there is no target %.*s\n", static_cast<int>(name.size()), name.data());
  std::exit(2);
}

void require(bool holds, const char* law) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", law);
  std::abort();
}

std::string as_file(std::string_view bytes) {
  static const int kDescriptor = memfd_create("fuzz", MFD_CLOEXEC);
  require(
      kDescriptor >= 0 && ftruncate(kDescriptor, 0) == 0 &&
          pwrite(kDescriptor, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()),
      "there is room for a file");
  return "/proc/self/fd/" + std::to_string(kDescriptor);
}

}  // namespace treeroll::fuzz
