#include "learner/web/study_site.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/base/content_hash.h"
#include "learner/web/page_files.h"
#include "learner/web/views/views.h"

namespace treeroll::web {
namespace {

/// A text is as good as new for so long; longer while nothing has been told.
constexpr Duration kFreshFor = std::chrono::milliseconds(300);
constexpr Duration kUnchangedFor = std::chrono::milliseconds(1500);
constexpr std::size_t kBuiltMax = 32;
constexpr Duration kWatchedFor = std::chrono::seconds(2);

std::string type_of(std::string_view name) {
  if (name.ends_with(".html")) return "text/html; charset=utf-8";
  if (name.ends_with(".css")) return "text/css; charset=utf-8";
  return "text/javascript; charset=utf-8";
}

std::optional<HttpResponse> file_response(std::string_view path) {
  const std::string_view name = path == "/" ? "page.html" : path.substr(1);
  for (const PageFile& file : page_files()) {
    if (file.name != name) continue;
    return HttpResponse{.type = type_of(name),
                        .body = std::make_shared<const std::string>(file.bytes),
                        .etag = fmt::format("\"{}\"", file.hash)};
  }
  return std::nullopt;
}

int read_integer(const std::string& key, std::string_view text, int min, std::int64_t max) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size() || value < min ||
      value > max) {
    throw ConfigError(key, std::string(text),
                      fmt::format("must be a whole number from {} to {}", min, max));
  }
  return static_cast<int>(value);
}

/// Reads a query strictly: what it does not name is an error too.
class QueryReader {
 public:
  explicit QueryReader(const HttpRequest& request) : left_(request.query) {}

  std::string text(const std::string& key, const std::string& otherwise) {
    const auto node = left_.extract(key);
    return node.empty() || node.mapped().empty() ? otherwise : node.mapped();
  }
  std::string one_of(const std::string& key, const std::vector<std::string>& words) {
    const std::string word = text(key, words.front());
    if (std::find(words.begin(), words.end(), word) != words.end()) return word;
    throw ConfigError(key, word, fmt::format("must be one of: {}", fmt::join(words, ", ")));
  }
  std::optional<int> integer(const std::string& key, std::int64_t max) {
    const std::string value = text(key, "");
    if (value.empty()) return std::nullopt;
    return read_integer(key, value, 0, max);
  }
  double number(const std::string& key) {
    const std::string value = text(key, "0");
    double number = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (error != std::errc{} || end != value.data() + value.size() || !(number >= 0)) {
      throw ConfigError(key, value, "must be a number, not negative");
    }
    return number;
  }
  void finish() const {
    if (!left_.empty()) {
      throw ConfigError(left_.begin()->first, left_.begin()->second, "is not known here");
    }
  }

 private:
  std::map<std::string, std::string> left_;
};

RunsQuery read_runs_query(const HttpRequest& request, const Study& study) {
  QueryReader reader(request);
  RunsQuery query;
  query.condition =
      reader.integer("condition", static_cast<std::int64_t>(study.conditions.size()) - 1);
  query.order = reader.one_of("order", {"run", "best", "worst", "failed"});
  query.from = reader.integer("from", study.num_runs()).value_or(0);
  reader.finish();
  return query;
}

RolloutsQuery read_rollouts_query(const HttpRequest& request, const Study& study) {
  QueryReader reader(request);
  RolloutsQuery query;
  query.condition =
      reader.integer("condition", static_cast<std::int64_t>(study.conditions.size()) - 1);
  query.run = reader.integer("run", study.num_runs() - 1);
  query.layer = reader.integer("layer", 1000);
  query.status = reader.text("status", "");
  if (!query.status.empty() && query.status != "failed" && !rollout_status(query.status)) {
    throw ConfigError("status", query.status, "must be failed, or a status of a roll-out");
  }
  query.reward_min = reader.number("reward_min");
  query.order = reader.one_of("order", {"newest", "number"});
  query.from = reader.text("from", "");
  reader.finish();
  return query;
}

}  // namespace

StudySite::StudySite(LiveStudy& study, RolloutShower& shower, std::function<TimePoint()> now)
    : study_(study), shower_(shower), now_(std::move(now)) {}

bool StudySite::is_watched() const {
  return state_asked_at_ != TimePoint{} && now_() - state_asked_at_ < kWatchedFor;
}

HttpResponse StudySite::built(const HttpRequest& request,
                              const std::function<std::string()>& build) {
  std::string address = request.path;
  for (const auto& [key, value] : request.query) address += "\n" + key + "\n" + value;
  const TimePoint now = now_();
  const auto found = std::find_if(built_.begin(), built_.end(),
                                  [&](const Built& each) { return each.address == address; });
  if (found != built_.end()) {
    const bool is_same = found->version == study_.version();
    if (now < found->at + (is_same ? kUnchangedFor : kFreshFor)) {
      built_.splice(built_.begin(), built_, found);
      return found->response;
    }
    built_.erase(found);
  }
  const auto text = std::make_shared<const std::string>(build());
  HttpResponse response{
      .body = text, .etag = fmt::format("\"{}\"", to_hex(content_hash(std::string_view(*text))))};
  built_.push_front({address, response, study_.version(), now});
  if (built_.size() > kBuiltMax) built_.pop_back();
  return response;
}

/// "3/17": run and number.
HttpResponse StudySite::rollout(const std::string& rest) {
  const std::size_t slash = rest.find('/');
  const std::string_view text = rest;
  const Study& what = study_.core().study();
  protocol::RolloutKey key;
  key.run = read_integer("run", text.substr(0, slash), 0, what.num_runs() - 1);
  const learner::Run& run = study_.core().runs()[static_cast<std::size_t>(key.run)];
  const auto condition = static_cast<std::size_t>(run.condition());
  key.number = read_integer("rollout", slash == std::string::npos ? "" : text.substr(slash + 1),
                            learner::Run::final_number(what.final_evaluations - 1) < -2
                                ? learner::Run::final_number(what.final_evaluations - 1)
                                : learner::Run::kStart,
                            what.conditions[condition].exploration.num_rollouts - 1);
  const RolloutShower::Shown shown = shower_.show(key, run.answer_of(key.number).has_value());
  if (shown.text) {
    return {.body = shown.text,
            .etag = fmt::format("\"{}\"", to_hex(content_hash(std::string_view(*shown.text))))};
  }
  const nlohmann::json said = shown.failure.empty() ? nlohmann::json{{"making", true}}
                                                    : nlohmann::json{{"failure", shown.failure}};
  return {.status = shown.failure.empty() ? 202 : 200,
          .body = std::make_shared<const std::string>(
              said.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace))};
}

HttpResponse StudySite::answer(const HttpRequest& request) {
  const std::string& path = request.path;
  const Study& what = study_.core().study();
  const auto below = [&path](const std::string& folder) -> std::optional<std::string> {
    if (!path.starts_with(folder)) return std::nullopt;
    return path.substr(folder.size());
  };
  try {
    if (path == "/healthz") return plain(200, "ok");
    if (path == "/metrics") {
      HttpResponse response = built(request, [&] { return metrics_view(study_, now_()); });
      response.type = "text/plain; version=0.0.4; charset=utf-8";
      return response;
    }
    if (path == "/api/state") state_asked_at_ = now_();
    if (path == "/api/state") return built(request, [&] { return state_view(study_, now_()); });
    if (path == "/api/curves") return built(request, [&] { return curves_view(study_); });
    if (path == "/api/study") return built(request, [&] { return study_view(study_); });
    if (path == "/api/runs") {
      const RunsQuery query = read_runs_query(request, what);
      return built(request, [&] { return runs_view(study_, query); });
    }
    if (path == "/api/rollouts") {
      const RolloutsQuery query = read_rollouts_query(request, what);
      return built(request, [&] { return rollouts_view(study_, query); });
    }
    if (const auto rest = below("/api/conditions/")) {
      const auto last = static_cast<std::int64_t>(what.conditions.size()) - 1;
      const int condition = read_integer("condition", *rest, 0, last);
      return built(request, [&] { return condition_view(study_, condition); });
    }
    if (const auto rest = below("/api/runs/")) {
      const int run = read_integer("run", *rest, 0, what.num_runs() - 1);
      return built(request, [&] { return run_view(study_, run); });
    }
    if (const auto rest = below("/api/rollouts/")) return rollout(*rest);
  } catch (const ConfigError& error) {
    return plain(400, error.what());
  }
  if (std::optional<HttpResponse> file = file_response(path)) return *std::move(file);
  return plain(404, "nothing is here");
}

}  // namespace treeroll::web
