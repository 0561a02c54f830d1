#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/worker_app/child.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

struct Ended {
  std::optional<int> status;
  std::string output;
  std::string errors;
};

Ended run_worker(const std::vector<std::string>& arguments, const std::string& input = "") {
  Child child(arguments, input);
  const std::optional<int> status = child.wait();
  return {status, child.output(), child.errors()};
}

TEST(DescribeTaskTest, PrintsDescriptionAndResolvedSettings) {
  const Ended outcome =
      run_worker({"--describe-task"}, R"({"name": "synthetic", "settings": {"time_limit_s": 3}})");
  EXPECT_EQ(outcome.status, 0);
  const json printed = json::parse(outcome.output);
  EXPECT_EQ(printed["description"]["input_dim"], 1);
  EXPECT_EQ(printed["description"]["time_limit_s"], 3);
  EXPECT_EQ(printed["description"]["deterministic"], true);
  EXPECT_EQ(printed["settings"]["time_limit_s"], 3);
  EXPECT_EQ(printed["settings"]["mode"], "burn");
}

TEST(DescribeTaskTest, SaysWhichSettingIsWrongAndWhy) {
  const Ended outcome =
      run_worker({"--describe-task"}, R"({"name": "synthetic", "settings": {"duration_us": -4}})");
  EXPECT_EQ(outcome.status, 2);
  const json error = json::parse(outcome.output)["error"];
  EXPECT_EQ(error["key"], "task.duration_us");
  EXPECT_EQ(error["value"], "-4");
  EXPECT_THAT(error["rule"].get<std::string>(), HasSubstr("must be an integer from 0"));
}

TEST(DescribeTaskTest, RefusesWhatIsNoTask) {
  for (const char* input :
       {"", "x", "[]", "{}", R"({"name": 3, "settings": {}})",
        R"({"name": "synthetic", "settings": []})", R"({"name": "nobody", "settings": {}})",
        R"({"name": "synthetic", "settings": {}, "more": 1})", "{\"name\": \"\xff\"}"}) {
    const Ended outcome = run_worker({"--describe-task"}, input);
    EXPECT_EQ(outcome.status, 2) << input;
    EXPECT_TRUE(json::parse(outcome.output).contains("error")) << input;
  }
}

TEST(DescribeTaskTest, AgreesWithWhatItHasResolvedAndRefusesAllElse) {
  json content{{"name", "synthetic"}, {"settings", {{"time_limit_s", 3}}}};
  const json printed = json::parse(run_worker({"--describe-task"}, content.dump()).output);
  content["settings"] = printed["settings"];
  content["described"] = printed["description"];
  EXPECT_EQ(json::parse(run_worker({"--describe-task"}, content.dump()).output), printed);
  // A study that was begun with a worker of other defaults.
  content["settings"].erase("duration_us");
  const Ended other = run_worker({"--describe-task"}, content.dump());
  EXPECT_EQ(other.status, 2);
  EXPECT_EQ(json::parse(other.output)["error"]["key"], "task.duration_us");
  EXPECT_THAT(json::parse(other.output)["error"]["rule"].get<std::string>(),
              HasSubstr("did not exist when the study began"));
  content["settings"] = printed["settings"];
  content["described"]["version"] = "2";
  EXPECT_EQ(json::parse(run_worker({"--describe-task"}, content.dump()).output)["error"]["key"],
            "task.described.version");
}

TEST(DescribeTaskTest, RefusesBottomlessNesting) {
  const std::string deep = R"({"name": "synthetic", "settings": )" + std::string(100'000, '[');
  const Ended outcome = run_worker({"--describe-task"}, deep);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.output, HasSubstr("must not be nested deeper than 64"));
}

TEST(DescribeTaskTest, RefusesAnEndlessInput) {
  EXPECT_EQ(run_worker({"--describe-task"}, std::string((1U << 20U) + 1, ' ')).status, 2);
}

TEST(WorkerOptionsTest, BadOnesAreNamedAndEndWithStatusTwo) {
  for (const char* number : {"0", "-1", "1025", "two", "1.5", "99999999999999999999"}) {
    const Ended outcome = run_worker({std::string("--processes=") + number});
    EXPECT_EQ(outcome.status, 2) << number;
    EXPECT_THAT(outcome.errors, HasSubstr(std::string("--processes = ") + number +
                                          ": must be an integer from 1 to 1024"));
  }
  const Ended unknown = run_worker({"--proceses=2"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_THAT(unknown.errors, HasSubstr("--proceses"));
  const Ended url = run_worker({"--processes=1", "--lcm-url=udpm://nonsense"});
  EXPECT_EQ(url.status, 2);
  EXPECT_THAT(url.errors, HasSubstr("nonsense"));
}

TEST(WorkerOptionsTest, VersionIsPrinted) {
  const Ended outcome = run_worker({"--version"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_THAT(outcome.output, HasSubstr("treeroll-worker 0."));
}

}  // namespace
}  // namespace treeroll::worker
