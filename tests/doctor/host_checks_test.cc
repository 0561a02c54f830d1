#include "common/doctor/host_checks.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include "tests/files/scratch_folder.h"

namespace treeroll::doctor {
namespace {

using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;

constexpr const char* kSnmp =
    "Ip: Forwarding DefaultTTL\n"
    "Ip: 1 64\n"
    "Udp: InDatagrams NoPorts InErrors OutDatagrams RcvbufErrors SndbufErrors\n"
    "Udp: 13083341 26 2500 7018133 42 7\n"
    "UdpLite: InDatagrams NoPorts InErrors OutDatagrams RcvbufErrors SndbufErrors\n"
    "UdpLite: 0 0 0 0 99 0\n";

TEST(HostChecksTest, CountsWhatFullSocketsHaveLostAndNotWhatFiltersRefuse) {
  EXPECT_EQ(lost_in_full_sockets(kSnmp), 42);
  EXPECT_EQ(lost_in_full_sockets(""), 0);
  EXPECT_EQ(lost_in_full_sockets("Udp: RcvbufErrors"), 0);
  EXPECT_EQ(lost_in_full_sockets("Udp: InDatagrams\nUdp: 5\n"), 0);
  EXPECT_EQ(lost_in_full_sockets("Udp: InDatagrams RcvbufErrors\nUdp: 5\n"), 0);
}

TEST(HostChecksTest, LossesThatGrowAreTroubleAndOldOnesANotice) {
  EXPECT_EQ(judge_drops(0, 0, 3).level, Level::kOk);
  EXPECT_EQ(judge_drops(5, 5, 3).level, Level::kNotice);
  EXPECT_EQ(judge_drops(5, 6, 3).level, Level::kTrouble);
}

TEST(HostChecksTest, LoopbackIsTroubleOnlyWhereOtherHostsAreToBeReached) {
  const WayOut loopback{"127.0.0.1", "lo", true};
  const WayOut ethernet{"10.0.0.3", "eth0", false};
  EXPECT_EQ(judge_route(loopback, "239.255.76.67", 0).level, Level::kOk);
  EXPECT_EQ(judge_route(loopback, "239.255.76.67", 1).level, Level::kTrouble);
  EXPECT_EQ(judge_route(ethernet, "239.255.76.67", 1).level, Level::kOk);
  const Finding none = judge_route(std::nullopt, "239.255.76.67", 1);
  EXPECT_EQ(none.level, Level::kTrouble);
  EXPECT_THAT(none.cure, HasSubstr("ip route add"));
}

TEST(HostChecksTest, ABufferThatTheKernelCutsComesWithItsCure) {
  EXPECT_EQ(judge_receive_buffer(4 << 20, 4 << 20).level, Level::kOk);
  const Finding small = judge_receive_buffer(212992, 4 << 20);
  EXPECT_EQ(small.level, Level::kNotice);
  EXPECT_THAT(small.cure, HasSubstr("net.core.rmem_max=4194304"));
}

TEST(HostChecksTest, AFolderOfResultsIsThereAndWritable) {
  const ScratchFolder folder;
  EXPECT_THAT(check_folder(folder.path()), Contains(Field(&Finding::subject, "sync")));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "what was written for the look is gone";
  const Findings none = check_folder(folder.path() / "none");
  ASSERT_EQ(none.size(), 1U);
  EXPECT_EQ(none[0].level, Level::kTrouble);
  EXPECT_THAT(none[0].cure, HasSubstr("mkdir -p"));
  const Findings kernel = check_folder("/proc");
  ASSERT_FALSE(kernel.empty());
  EXPECT_EQ(kernel[0].level, Level::kTrouble) << "nobody can write there, root neither";
}

}  // namespace
}  // namespace treeroll::doctor
