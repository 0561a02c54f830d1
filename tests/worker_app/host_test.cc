// What a worker finds out about its host: names and limits as any system may have them.
#include <gmock/gmock.h>
#include <sched.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/program/host_name.h"
#include "common/program/processor_share.h"
#include "tests/files/scratch_folder.h"
#include "workers/app/host_facts.h"

namespace treeroll::worker {
namespace {

namespace fs = std::filesystem;

/// A tree of control groups in files.
class ProcessorShareTest : public ::testing::Test {
 protected:
  void write(const std::string& file, const std::string& text) const {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }
  double processors(const std::string& membership) const {
    write("membership", membership);
    return cgroup_processors(root_ / "membership", root_ / "mount");
  }

  ScratchFolder scratch_;
  fs::path root_ = scratch_.path();
};

TEST_F(ProcessorShareTest, VersionTwoTakesTheLeastOfAGroupAndThoseAboveIt) {
  EXPECT_TRUE(std::isinf(processors("0::/a/b\n")));
  write("mount/a/b/cpu.max", "max 100000\n");
  EXPECT_TRUE(std::isinf(processors("0::/a/b\n")));
  write("mount/a/cpu.max", "250000 100000\n");
  EXPECT_EQ(processors("0::/a/b\n"), 2.5);
  write("mount/a/b/cpu.max", "50000 100000\n");
  EXPECT_EQ(processors("0::/a/b\n"), .5);
  EXPECT_EQ(processors("0::/a\n"), 2.5);
  // In a container the path may be the host's, and the mount is what is seen of it.
  write("mount/cpu.max", "150000 100000\n");
  EXPECT_EQ(processors("0::/not/seen/here\n"), 1.5);
}

TEST_F(ProcessorShareTest, VersionOneHasItsOwnHierarchy) {
  write("mount/cpu/a/cpu.cfs_quota_us", "300000\n");
  write("mount/cpu/a/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(processors("5:memory:/b\n4:cpu,cpuacct:/a\n0::/c\n"), 3);
  EXPECT_TRUE(std::isinf(processors("4:cpuset:/a\n")));
  write("mount/cpu/a/cpu.cfs_quota_us", "-1\n");
  EXPECT_TRUE(std::isinf(processors("4:cpu,cpuacct:/a\n")));
}

TEST_F(ProcessorShareTest, WhatCannotBeReadLimitsNothing) {
  EXPECT_TRUE(std::isinf(processors("")));
  EXPECT_TRUE(std::isinf(processors("nonsense\n::\n0:\n:cpu:a\n")));
  write("mount/a/cpu.max", "no number\n");
  EXPECT_TRUE(std::isinf(processors("0::/a\n")));
  EXPECT_TRUE(std::isinf(cgroup_processors(root_ / "none", root_ / "none")));
}

TEST_F(ProcessorShareTest, AProcessThatIsBoundToOneProcessorUsesOne) {
  cpu_set_t before;
  ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
  cpu_set_t one;
  CPU_ZERO(&one);
  for (int i = 0; i < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++i) {
    if (CPU_ISSET(i, &before)) CPU_SET(i, &one);
  }
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  EXPECT_EQ(num_usable_processors(), 1);
  ASSERT_EQ(sched_setaffinity(0, sizeof before, &before), 0);
  EXPECT_LE(num_usable_processors(), CPU_COUNT(&before));
}

TEST(HostFactsTest, AHostNameOfAnyBytesBecomesOneThatLearnersTake) {
  EXPECT_EQ(readable("robot-7.lab"), "robot-7.lab");
  EXPECT_EQ(readable("\xff\xfe a\n\x1b[31m"), "???a??[31m");
}

}  // namespace
}  // namespace treeroll::worker
