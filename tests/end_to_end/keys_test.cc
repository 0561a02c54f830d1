// Daemons with keys: the results stay, and who has none is not heard.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

using std::chrono::seconds;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kQuick =
    text_of(SyntheticStudy{.study = "name = \"keys\"\nrepetitions = 4\nrollouts = 40\n",
                           .task = "mode = \"sleep\"\nduration_us = 200\n"});

/// A service with the key files of a learner and of a worker of its.
class KeysTest : public ::testing::Test {
 protected:
  KeysTest() {
    EXPECT_EQ(service_.run("treeroll-keygen", {key("learner.key")}).status, 0);
    EXPECT_EQ(
        service_.run("treeroll-keygen", {key("worker.key"), "--worker-of", key("learner.key")})
            .status,
        0);
  }
  std::string key(const std::string& name) const { return (service_.directory() / name).string(); }
  std::vector<std::string> worker(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{"--processes", "1", "--lcm-url", service_.url()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  Service service_;
};

TEST_F(KeysTest, TheBytesAreThoseWithoutKeysAndWhoHasNoneIsNotHeard) {
  const auto plain = service_.learn(service_.study(kQuick), {"--local-workers", "1"});
  ASSERT_EQ(plain.status, 0) << plain.log;
  EXPECT_THAT(plain.log, HasSubstr("no --key-file: whoever reaches the group may answer"));
  {
    const auto local = service_.learn(service_.study(kQuick),
                                      {"--local-workers", "1", "--key-file", key("learner.key")});
    ASSERT_EQ(local.status, 0) << local.log;
    EXPECT_EQ(local.rollouts_csv, plain.rollouts_csv);
    EXPECT_THAT(local.log, HasSubstr("takes only what is signed with a key of "));
  }
  Daemon stranger("treeroll-worker", worker(), service_.directory());
  Daemon own("treeroll-worker", worker({"--key-file", key("worker.key")}), service_.directory());
  const auto keyed = service_.learn(service_.study(kQuick), {"--key-file", key("learner.key")});
  ASSERT_EQ(keyed.status, 0) << keyed.log;
  EXPECT_EQ(keyed.rollouts_csv, plain.rollouts_csv);
  EXPECT_THAT(keyed.log, HasSubstr("signs nothing: it runs without --key-file"));
  EXPECT_EQ(keyed.summary["workers"].size(), 1U);
  EXPECT_THAT(stranger.standard_error(), Not(HasSubstr("serves learner")));
}

TEST_F(KeysTest, KeyFilesThatDoNotServeAreRefusedBeforeAnythingStarts) {
  const auto study = service_.study(kQuick).string();
  const auto said = [&](const std::string& key_file) {
    const Said said = service_.run("treeroll-learner",
                                   {study, "--lcm-url", service_.url(), "--key-file", key_file});
    EXPECT_EQ(said.status, 2) << said.errors;
    return said.errors;
  };
  EXPECT_THAT(said(key("absent.key")), HasSubstr("absent.key"));
  EXPECT_THAT(said(key("worker.key")), HasSubstr("must hold a learner's key"));
  std::filesystem::permissions(key("learner.key"), std::filesystem::perms::group_read,
                               std::filesystem::perm_options::add);
  EXPECT_THAT(said(key("learner.key")),
              AllOf(HasSubstr("--key-file"), HasSubstr("readable by its owner alone")));
}

/// On a worker's host there is no learner's key.
TEST_F(KeysTest, TheDoctorFindsAWorkerWithKeysWellWithoutALearnersKey) {
  Daemon signing("treeroll-worker", worker({"--key-file", key("worker.key")}),
                 service_.directory());
  ASSERT_TRUE(eventually(seconds(20), [&] {
    return signing.standard_error().find("takes only what is signed") != std::string::npos;
  }));
  const auto examine = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"--lcm-url", service_.url(), "--seconds", "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Said said = service_.run("treeroll-doctor", arguments);
    EXPECT_EQ(said.status, 0) << said.output << said.errors;
    return said.output;
  };
  EXPECT_THAT(examine({}), HasSubstr("is heard, and signs what it says"));
  EXPECT_THAT(examine({"--key-file", key("worker.key")}), HasSubstr("ours is a worker's"));
  EXPECT_THAT(examine({"--key-file", key("learner.key")}), Not(HasSubstr("1 worker with keys")))
      << "with this one it is tried";
}

TEST_F(KeysTest, KeygenOverwritesNothingAndPrintsNoSecret) {
  const std::string before = read_file(key("learner.key"));
  const Said again = service_.run("treeroll-keygen", {key("learner.key")});
  EXPECT_EQ(again.status, 2);
  EXPECT_THAT(again.errors, HasSubstr("must not exist"));
  EXPECT_EQ(read_file(key("learner.key")), before);
  const Said next = service_.run(
      "treeroll-keygen",
      {key("next.key"), "--worker-of", key("learner.key"), "--same-worker-as", key("worker.key")});
  EXPECT_EQ(next.status, 0) << next.errors;
  EXPECT_EQ(next.output, key("next.key") + "\n");
  const auto id_of = [&](const std::string& path) {
    const std::string text = read_file(path);
    return text.substr(text.find("\nworker ") + 8, 16);
  };
  EXPECT_EQ(id_of(key("next.key")), id_of(key("worker.key")));
}

/// The daemon looks at its file every two seconds.
TEST_F(KeysTest, ADaemonTakesANewKeyWhileItRuns) {
  Daemon worker_daemon("treeroll-worker", worker({"--key-file", key("worker.key")}),
                       service_.directory());
  EXPECT_EQ(service_.run("treeroll-keygen", {key("new.key")}).status, 0);
  EXPECT_EQ(service_
                .run("treeroll-keygen", {key("new_worker.key"), "--worker-of", key("new.key"),
                                         "--same-worker-as", key("worker.key")})
                .status,
            0);
  ASSERT_TRUE(eventually(seconds(20), [&] {
    return worker_daemon.standard_error().find("takes only what is signed") != std::string::npos;
  }));
  std::filesystem::rename(key("new_worker.key"), key("worker.key"));
  const auto learnt = service_.learn(service_.study(kQuick), {"--key-file", key("new.key")});
  EXPECT_EQ(learnt.status, 0) << learnt.log;
}

}  // namespace
}  // namespace treeroll::end_to_end
