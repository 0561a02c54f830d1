#include "common/transport/key_file.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>

#include "common/base/config_error.h"
#include "tests/files/scratch_folder.h"

namespace treeroll::transport {
namespace {

using testing::HasSubstr;

Key some_key(unsigned char value) {
  Key key{};
  key.fill(value);
  return key;
}

std::string problem(const std::string& text) {
  const auto keys = KeyRing::parse(text);
  return keys ? "none" : keys.error().message;
}

class KeyFileTest : public testing::Test {
 protected:
  void write(const std::string& text, mode_t mode = 0600) {
    std::filesystem::remove(path_);
    std::ofstream(path_) << text;
    chmod(path_.c_str(), mode);
  }
  std::string problem_of_file() {
    const auto file = KeyFile::open(path_);
    return file ? "none" : file.error().message;
  }

  ScratchFolder scratch_;
  std::filesystem::path path_ = scratch_.path() / "key";
};

TEST(KeyRingTest, ReadsTheLinesItWrites) {
  const WorkerKey worker = worker_key(some_key(7), 0x1234);
  const auto workers = KeyRing::parse("# mine\n\n  " + line_of(worker) + " # host17\r\n" +
                                      line_of(worker_key(some_key(8), 0x1234)));
  ASSERT_TRUE(workers);
  EXPECT_FALSE(workers->is_learners());
  EXPECT_EQ(workers->worker_keys().size(), 2U);
  EXPECT_EQ(workers->worker_keys()[0], worker);
  const auto learners = KeyRing::parse(line_of(some_key(7)));
  ASSERT_TRUE(learners);
  EXPECT_EQ(learners->learner_keys(), std::vector<Key>{some_key(7)});
}

TEST(KeyRingTest, WhatIsNoKeyIsRefusedWithItsLineAndWithoutItsText) {
  const std::string learner = line_of(some_key(7));
  const std::string worker = line_of(worker_key(some_key(7), 1));
  EXPECT_EQ(problem(""), "holds no key");
  EXPECT_EQ(problem("# nothing\n"), "holds no key");
  EXPECT_THAT(problem(learner + "\n" + worker), HasSubstr("must be those of one"));
  EXPECT_THAT(problem(worker + "\n" + line_of(worker_key(some_key(7), 2))),
              HasSubstr("holds keys of two workers"));
  EXPECT_THAT(problem(learner + "\n" + learner.substr(0, learner.size() - 1)),
              HasSubstr("line 2: must be"));
  for (const std::string& bad : std::vector<std::string>{
           learner + "0", learner + " 00", "learner", "learner " + std::string(64, 'g'),
           "worker 0000000000000000" + worker.substr(23),
           "worker ffffffffffffffff" + worker.substr(23), worker.substr(0, 90),
           "lerner " + std::string(64, '0'), std::string("learner \0", 9)}) {
    EXPECT_THAT(problem(bad), HasSubstr("line 1: must be")) << bad;
    EXPECT_THAT(problem(bad), testing::Not(HasSubstr("0707")));
  }
  std::string many;
  for (unsigned char i = 0; i < 5; ++i) many += line_of(some_key(i)) + "\n";
  EXPECT_EQ(problem(many), "holds more than 4 keys");
}

TEST(KeyRingTest, KeysOfWorkersAndOfAnnouncementsAllDiffer) {
  const WorkerKey one = worker_key(some_key(7), 1);
  const WorkerKey two = worker_key(some_key(7), 2);
  EXPECT_NE(one.own, two.own);
  EXPECT_EQ(one.announcements, two.announcements);
  EXPECT_NE(one.own, one.announcements);
  EXPECT_NE(one.announcements, some_key(7));
  EXPECT_GT(announcement_id(one.announcements), 0);
}

TEST_F(KeyFileTest, IsRefusedIfOthersCanReadIt) {
  write(line_of(some_key(7)));
  EXPECT_EQ(problem_of_file(), "none");
  for (const mode_t mode : {0640, 0604, 0620, 0660, 0644}) {
    write(line_of(some_key(7)), mode);
    EXPECT_THAT(problem_of_file(), HasSubstr("must be readable by its owner alone")) << mode;
  }
}

TEST_F(KeyFileTest, IsRefusedWithItsPathAndTheRule) {
  EXPECT_THAT(problem_of_file(), HasSubstr("No such file"));
  write("nonsense");
  EXPECT_THAT(problem_of_file(), HasSubstr(path_.string() + ": line 1"));
  write(std::string(kKeyFileBytesMax + 1, '#'));
  EXPECT_THAT(problem_of_file(), HasSubstr("at most 4096 bytes"));
  std::filesystem::remove(path_);
  std::filesystem::create_directory(path_);
  EXPECT_THAT(problem_of_file(), HasSubstr("must be a regular file"));
  std::filesystem::remove(path_);
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  EXPECT_THAT(problem_of_file(), HasSubstr("must be a regular file"));
}

TEST_F(KeyFileTest, AWorkersKeyIsNoLearners) {
  write(line_of(worker_key(some_key(7), 1)));
  EXPECT_TRUE(key_file_of("--key-file", path_, Voice::kWorker));
  EXPECT_THROW(key_file_of("--key-file", path_, Voice::kLearner), ConfigError);
  EXPECT_FALSE(key_file_of("--key-file", {}, Voice::kLearner));
}

TEST_F(KeyFileTest, ARunningWorkerKeepsItsName) {
  write(line_of(worker_key(some_key(7), 0x1122334455667788)));
  auto file = KeyFile::open(path_);
  ASSERT_TRUE(file);
  EXPECT_EQ(file->keys().worker_id(0x7fffffff00000005), 0x1122337f00000005);
  EXPECT_TRUE(may_sign_for(0x1122334455667788, 0x1122337f00000005));
  EXPECT_FALSE(may_sign_for(0x1122334455667788, 0x1122340000000005));
  write(line_of(worker_key(some_key(7), 5)));
  const auto changed = file->look_again();
  ASSERT_FALSE(changed);
  EXPECT_THAT(changed.error().message, HasSubstr("another worker's key"));
  write(line_of(worker_key(some_key(8), 0x1122334455667788)));
  EXPECT_TRUE(*file->look_again());
}

TEST_F(KeyFileTest, IsReadAgainWhenItHasChangedAndKeptWhereItIsWorse) {
  write(line_of(some_key(7)));
  auto file = KeyFile::open(path_);
  ASSERT_TRUE(file);
  EXPECT_FALSE(*file->look_again());
  write(line_of(some_key(8)));
  EXPECT_TRUE(*file->look_again());
  EXPECT_EQ(file->keys().learner_keys()[0], some_key(8));
  write("nonsense");
  EXPECT_FALSE(file->look_again());
  EXPECT_FALSE(*file->look_again());  // said once
  write(line_of(worker_key(some_key(7), 1)));
  EXPECT_FALSE(file->look_again());
  std::filesystem::remove(path_);
  EXPECT_FALSE(file->look_again());
  EXPECT_EQ(file->keys().learner_keys()[0], some_key(8));
}

}  // namespace
}  // namespace treeroll::transport
