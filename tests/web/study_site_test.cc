#include "learner/web/study_site.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "learner/web/page_files.h"
#include "tests/web/fed_study.h"

namespace treeroll::web {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::StartsWith;

class StudySiteTest : public testing::Test {
 protected:
  HttpResponse get(const std::string& target) {
    HttpRequest request;
    EXPECT_TRUE(read_target(target, request));
    return site_.answer(request);
  }

  FedStudy study_{learner::small_study(40, 3)};
  transport::Loop loop_;
  RolloutShower shower_{loop_, {"/bin/false", {}}};
  StudySite site_{*study_.live, shower_, [this] { return study_.now; }};
};

TEST_F(StudySiteTest, ThePageIsInsideTheProgramAndNamesNothingOutside) {
  const HttpResponse page = get("/");
  EXPECT_THAT(*page.body, StartsWith("<!doctype html>"));
  EXPECT_EQ(page.type, "text/html; charset=utf-8");
  for (const PageFile& file : page_files()) {
    EXPECT_EQ(get("/" + std::string(file.name)).body->size(), file.bytes.size());
    if (file.name.starts_with("uplot/")) continue;
    EXPECT_EQ(file.bytes.find("http://"), std::string_view::npos) << file.name;
    EXPECT_EQ(file.bytes.find("https://"), std::string_view::npos) << file.name;
    EXPECT_EQ(file.bytes.find("innerHTML"), std::string_view::npos) << file.name;
  }
}

TEST_F(StudySiteTest, EveryAddressOfAViewIsJson) {
  study_.answer(60);
  study_.tick();
  for (const char* target :
       {"/api/study", "/api/state", "/api/curves", "/api/conditions/0", "/api/runs",
        "/api/runs?condition=0&order=best&from=0", "/api/runs/2", "/api/rollouts",
        "/api/rollouts?run=1&status=ok&layer=1&reward_min=0.01&order=number&from=1:3"}) {
    const HttpResponse response = get(target);
    EXPECT_EQ(response.status, 200) << target << *response.body;
    EXPECT_FALSE(json::parse(*response.body, nullptr, false).is_discarded()) << target;
  }
  EXPECT_EQ(*get("/healthz").body, "ok\n");
  EXPECT_THAT(*get("/metrics").body, HasSubstr("treeroll_rollouts_applied_total"));
}

TEST_F(StudySiteTest, WhatIsNotUnderstoodIsNamedWithItsRule) {
  for (const char* target :
       {"/api/runs/3", "/api/runs/-1", "/api/runs/x", "/api/runs/", "/api/runs/1x",
        "/api/runs/99999999999999999999", "/api/conditions/1", "/api/runs?order=up",
        "/api/runs?condition=1", "/api/runs?from=-1", "/api/runs?other=1",
        "/api/rollouts?status=bad", "/api/rollouts?reward_min=nan", "/api/rollouts/0",
        "/api/rollouts/0/40", "/api/rollouts/0/-3", "/api/rollouts/9/1"}) {
    const HttpResponse response = get(target);
    EXPECT_EQ(response.status, 400) << target;
    EXPECT_THAT(*response.body, testing::AnyOf(HasSubstr("must be"), HasSubstr("is not known")));
  }
  for (const char* target : {"/x", "/../etc/passwd", "/page.html/", "/api", "/api/none"}) {
    EXPECT_EQ(get(target).status, 404) << target;
  }
}

TEST_F(StudySiteTest, ATextIsBuiltOnceForAllWhoAskAtATime) {
  study_.answer(20);
  const auto first = get("/api/state").body;
  study_.answer(1);
  EXPECT_EQ(get("/api/state").body, first);
  study_.now += std::chrono::milliseconds(400);
  EXPECT_NE(*get("/api/state").body, *first);
  const auto second = get("/api/state").body;
  study_.now += std::chrono::milliseconds(400);
  EXPECT_EQ(get("/api/state").body, second);  // nothing has been told since
}

TEST_F(StudySiteTest, ARolloutIsBeingMadeUntilItIsThere) {
  study_.answer(20);
  EXPECT_EQ(get("/api/rollouts/1/2").status, 202);
}

}  // namespace
}  // namespace treeroll::web
