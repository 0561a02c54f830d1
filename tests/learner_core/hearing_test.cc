#include "learner/core/hearing.h"

#include <gtest/gtest.h>

#include "common/protocol/timings.h"

namespace treeroll::learner {
namespace {

TimePoint at_ms(int ms) { return TimePoint(std::chrono::milliseconds(ms)); }

Hearing one_that_hears() {
  Hearing hearing;
  hearing.note_word(at_ms(0), 3);
  hearing.note_echo(3);
  return hearing;
}

TEST(HearingTest, WhoHasReadTheBatchThatGreetsItHears) {
  Hearing hearing;
  EXPECT_FALSE(hearing.note_echo(1'000)) << "nobody has greeted it: a recording";
  ASSERT_TRUE(hearing.greeting_due(at_ms(0)));
  hearing.note_word(at_ms(0), 3);
  EXPECT_FALSE(hearing.note_echo(2)) << "said before the greeting was sent";
  EXPECT_FALSE(hearing.hears());
  EXPECT_TRUE(hearing.note_echo(3));
  EXPECT_TRUE(hearing.hears());
  EXPECT_FALSE(hearing.note_echo(4)) << "that is nothing new";
}

TEST(HearingTest, IsGreetedEverMoreSeldomAndNamedOnceASpell) {
  Hearing hearing;
  int num_greetings = 0;
  int num_told = 0;
  for (int ms = 0; ms < 10'000; ms += 10) {
    if (hearing.greeting_due(at_ms(ms))) {
      hearing.note_word(at_ms(ms), ++num_greetings);
      EXPECT_FALSE(hearing.greeting_due(at_ms(ms)));
    }
    const bool tells = hearing.deafness_to_tell(at_ms(ms));
    EXPECT_TRUE(!tells || at_ms(ms) >= at_ms(0) + protocol::kDeafnessTold);
    num_told += tells ? 1 : 0;
  }
  EXPECT_EQ(num_greetings, 8);  // 0, .1, .3, .7, 1.5, 3.1, 6.3, 9.5 s
  EXPECT_EQ(num_told, 1);
}

TEST(HearingTest, WithEachLostLeaseItIsAskedLess) {
  Hearing hearing = one_that_hears();
  EXPECT_EQ(hearing.share_of(64), 64);
  EXPECT_FALSE(hearing.note_lost(at_ms(10), at_ms(0)));
  EXPECT_TRUE(hearing.is_first_choice()) << "any network loses a message";
  EXPECT_FALSE(hearing.note_lost(at_ms(11), at_ms(5))) << "issued before: of the same mishap";
  EXPECT_TRUE(hearing.is_first_choice());
  hearing.note_lost(at_ms(20), at_ms(10));
  EXPECT_FALSE(hearing.is_first_choice());
  EXPECT_EQ(hearing.share_of(64), 16);
  hearing.note_lost(at_ms(30), at_ms(20));
  EXPECT_EQ(hearing.share_of(64), 8);
  hearing.note_lost(at_ms(40), at_ms(30));
  EXPECT_TRUE(hearing.note_lost(at_ms(50), at_ms(40)));
  EXPECT_FALSE(hearing.hears());
  EXPECT_EQ(hearing.share_of(64), 0);
}

TEST(HearingTest, WhoIsDoubtedIsTriedWithOneRolloutEverMoreSeldom) {
  Hearing hearing = one_that_hears();
  int now = 0;
  for (; hearing.hears(); ++now) hearing.note_lost(at_ms(now + 1), at_ms(now));
  for (int pause = 100; pause <= 3200; pause *= 2) {
    EXPECT_FALSE(hearing.greeting_due(at_ms(now + pause - 1))) << pause;
    now += pause;
    ASSERT_TRUE(hearing.greeting_due(at_ms(now))) << pause;
    hearing.note_word(at_ms(now), 100 + now);
    EXPECT_FALSE(hearing.note_echo(99 + now));
    EXPECT_TRUE(hearing.note_echo(100 + now));
    EXPECT_EQ(hearing.share_of(64), 1);
    EXPECT_FALSE(hearing.is_first_choice());
    EXPECT_TRUE(hearing.note_lost(at_ms(now), at_ms(now)));
  }
  hearing.note_confirmed();
  EXPECT_TRUE(hearing.is_first_choice());
  EXPECT_EQ(hearing.share_of(64), 64);
}

}  // namespace
}  // namespace treeroll::learner
