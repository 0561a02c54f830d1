#include "common/doctor/doctor.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "common/base/for_log.h"
#include "common/doctor/group_watch.h"
#include "common/doctor/host_checks.h"
#include "common/program/program.h"
#include "common/program/random_id.h"
#include "common/program/standard_output.h"
#include "common/transport/authenticator.h"
#include "common/transport/bus.h"
#include "common/transport/lcm_url.h"
#include "common/transport/loop.h"
#include "common/transport/signature.h"

namespace treeroll::doctor {
namespace {

using transport::Channel;
using transport::LcmUrl;

/// Between two words to the group: a worker answers each at once, and words are lost.
constexpr Duration kGreetingPeriod = std::chrono::milliseconds(200);

/// A proc file has no size that read_whole_file() could trust.
std::string read_snmp() {
  std::string text;
  if (FILE* file = std::fopen("/proc/net/snmp", "re")) {
    std::array<char, 4096> part{};
    while (const std::size_t count = std::fread(part.data(), 1, part.size(), file))
      text.append(part.data(), count);
    std::fclose(file);
  }
  return text;
}

void append(Findings& findings, Findings more) {
  std::move(more.begin(), more.end(), std::back_inserter(findings));
}

Finding say_keys(const std::optional<transport::KeyFile>& file) {
  if (!file) {
    return {Level::kNotice, "keys",
            "this program has none: what it hears is not verified, and whoever has one "
            "refuses what it says",
            "--key-file FILE where the group has keys; treeroll-keygen makes them"};
  }
  if (file->keys().is_learners()) {
    return {Level::kOk, "keys", "only what is signed with ours is heard"};
  }
  return {Level::kOk, "keys",
          "ours is a worker's: what learners say is checked with it; what workers say cannot be, "
          "and they refuse what this program says"};
}

/// What a worker of these keys makes of the message; nothing of one that is not signed where there
/// are none.
Proof proof_of(transport::Authenticator* worker, Channel channel,
               std::span<const std::byte> bytes) {
  Proof proof;
  if (transport::is_of_worker(channel)) {
    proof.is_unchecked = transport::index_in(bytes) > 0;
  } else if (worker != nullptr) {
    proof.refusal = worker->refusal(channel, bytes);
  }
  return proof;
}

/// Listens and greets for the time that was asked for.
Findings watch_group(const DoctorOptions& options, const LcmUrl& url) {
  transport::Loop loop;
  std::unique_ptr<GroupWatch> watch;
  transport::BusOptions bus_options;
  bus_options.url = options.lcm_url;
  bus_options.channels = {Channel::kRolloutBatch, Channel::kWorkerStatus, Channel::kLearnerStatus};
  bus_options.among_programs = true;
  const std::optional<transport::KeyFile> key_file =
      transport::key_file_of("--key-file", options.key_file, transport::Voice::kWorker);
  const bool speaks_as_learner = key_file && key_file->keys().is_learners();
  std::optional<transport::Authenticator> worker;
  Proof proof;
  if (speaks_as_learner) {
    bus_options.key_file = key_file;
  } else {
    if (key_file) worker.emplace(key_file->keys());
    bus_options.on_bytes = [&](Channel channel, std::span<const std::byte> bytes) {
      proof = proof_of(worker ? &*worker : nullptr, channel, bytes);
    };
  }
  bus_options.on_message = [&](const protocol::Message& message) {
    watch->take(loop.now(), message, proof);
  };
  auto opened = open_bus(loop, std::move(bus_options));
  if (!opened) return {{Level::kTrouble, "bus", opened.error().message}};
  const std::unique_ptr<transport::Bus> bus = *std::move(opened);
  watch = std::make_unique<GroupWatch>(
      GroupWatch::Settings{.id = random_id(),
                           .version = program_version(),
                           .group = fmt::format("{}, port {}", url.host, url.port),
                           .batch_bytes_max = bus->batch_bytes_max(),
                           .word_bytes = bus->word_bytes()});

  const bool is_udpm = url.provider == transport::Provider::kUdpm;
  const std::int64_t drops_before = lost_in_full_sockets(read_snmp());
  const TimePoint end = loop.now() + std::chrono::seconds(options.seconds);
  std::unique_ptr<transport::Timer> timer;
  const auto speak = [&] {
    if (loop.now() >= end) return loop.stop();
    bus->publish(watch->greeting(loop.now()));
    bus->publish(watch->longest_batch(loop.now()));
    timer->set(std::min(loop.now() + kGreetingPeriod, end));
  };
  timer = std::make_unique<transport::Timer>(loop, speak);
  speak();
  loop.run();

  Findings findings;
  const transport::BusStatistics statistics = bus->statistics();
  if (is_udpm) {
    findings.push_back(
        judge_receive_buffer(statistics.receive_buffer_bytes, url.receive_buffer_bytes));
    findings.push_back(
        judge_drops(drops_before, lost_in_full_sockets(read_snmp()), options.seconds));
  }
  if (statistics.num_unsent > 0) {
    findings.push_back({Level::kTrouble, "sending",
                        fmt::format("{} messages could not be sent: {}", statistics.num_unsent,
                                    statistics.last_publish_error),
                        "see `route`"});
  }
  findings.push_back(say_keys(key_file));
  if (statistics.num_rejected > 0) {
    findings.push_back(
        {Level::kNotice, "strangers",
         fmt::format("{} messages were refused, the last one: {}", statistics.num_rejected,
                     statistics.last_rejection),
         "somebody on the group runs another version, has another key or none, or is "
         "no treeroll: another port is another group"});
  }
  append(findings, watch->findings());
  return findings;
}

Findings look(const DoctorOptions& options) {
  Findings findings;
  findings.push_back(check_processors());
  append(findings, check_folder(options.folder));
  findings.push_back(check_clock());
  findings.push_back(check_gnuplot());
  const Result<LcmUrl> url = transport::parse_lcm_url(options.lcm_url);
  if (!url) {
    findings.push_back({Level::kTrouble, "url", url.error().message,
                        "treeroll-doctor --lcm-url 'udpm://239.255.76.67:7667?ttl=1', say"});
    return findings;
  }
  findings.push_back({Level::kOk, "url", url->text});
  if (url->provider == transport::Provider::kUdpm) {
    findings.push_back(judge_route(way_out_to(url->host, url->port), url->host, url->ttl));
    if (findings.back().level == Level::kTrouble) return findings;
  }
  append(findings, watch_group(options, *url));
  return findings;
}

const char* word(Level level) {
  if (level == Level::kOk) return "ok";
  return level == Level::kNotice ? "notice" : "trouble";
}

void print(const Findings& findings) {
  for (const Finding& finding : findings) {
    fmt::print("{:<8} {:<10} {}\n", word(finding.level), finding.subject, for_log(finding.text));
    if (!finding.cure.empty()) fmt::print("{:<19} -> {}\n", "", for_log(finding.cure));
  }
}

void print_json(const Findings& findings) {
  nlohmann::json list = nlohmann::json::array();
  for (const Finding& finding : findings) {
    list.push_back({{"level", word(finding.level)},
                    {"subject", finding.subject},
                    {"text", finding.text},
                    {"cure", finding.cure}});
  }
  // A path need not be UTF-8.
  fmt::print("{}\n", list.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

}  // namespace

bool examine(const DoctorOptions& options) {
  const Findings findings = look(options);
  options.json ? print_json(findings) : print(findings);
  flush_standard_output();
  return std::none_of(findings.begin(), findings.end(),
                      [](const Finding& finding) { return finding.level == Level::kTrouble; });
}

}  // namespace treeroll::doctor
