#include "common/base/signal_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace treeroll {
namespace {

using ::testing::HasSubstr;
using ::testing::Optional;

const SignalNames kPendulum{{"angle_rad", "rate_radps"}, {"torque_nm"}};

TEST(SignalNamesTest, NameEachInputAndOutputOrNone) {
  EXPECT_EQ(fault_of(kPendulum, 2, 1), std::nullopt);
  EXPECT_EQ(fault_of({}, 2, 1), std::nullopt);
  EXPECT_THAT(fault_of(kPendulum, 3, 1), Optional(HasSubstr("inputs: has 2 names, must have 3")));
  EXPECT_THAT(fault_of({{"t_s"}, {}}, 1, 1),
              Optional(HasSubstr("outputs: has 0 names, must have 1")));
  EXPECT_THAT(fault_of({{}, {"u"}}, 1, 1), Optional(HasSubstr("inputs: has 0 names")));
  EXPECT_THAT(fault_of({{"a", "a"}, {"u"}}, 2, 1), Optional(HasSubstr("inputs: each name")));
  EXPECT_EQ(fault_of({{"x"}, {"x"}}, 1, 1), std::nullopt) << "an output may act on an input";
}

TEST(SignalNamesTest, AreWordsThatStandInTablesAndOnAxesAsTheyAre) {
  for (const char* good : {"time_s", "wrist.x_m", "q[3]_rad", "\xc3\xb8_rad"}) {
    EXPECT_EQ(fault_of({{good}, {"u"}}, 1, 1), std::nullopt) << good;
  }
  for (const std::string& bad :
       {std::string(), std::string("time in s"), std::string("a,b"), std::string("a\"b"),
        std::string("a\\b"), std::string("a\nb"), std::string("a\x7f"), std::string(129, 'x')}) {
    EXPECT_THAT(fault_of({{"t"}, {bad}}, 1, 1), Optional(HasSubstr("outputs: the name"))) << bad;
  }
}

TEST(SignalNamesTest, DifferOnlyWhereBothNameSignals) {
  EXPECT_EQ(difference(kPendulum, "here they are", kPendulum), std::nullopt);
  EXPECT_EQ(difference(kPendulum, "here they are", {}), std::nullopt);
  EXPECT_EQ(difference({}, "here they are", kPendulum), std::nullopt);
  EXPECT_EQ(difference(kPendulum, "here they are", {{"rate_radps", "angle_rad"}, {"torque_nm"}}),
            "inputs are angle_rad, rate_radps, here they are rate_radps, angle_rad");
  EXPECT_EQ(difference(kPendulum, "here they are", {kPendulum.inputs, {"force_n"}}),
            "outputs are torque_nm, here they are force_n");
}

TEST(SignalNamesTest, AreInputsThenOutputs) {
  EXPECT_EQ(all_of(kPendulum), (std::vector<std::string>{"angle_rad", "rate_radps", "torque_nm"}));
}

}  // namespace
}  // namespace treeroll
