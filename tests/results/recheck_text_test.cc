#include "learner/results/recheck_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace treeroll {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

RecheckedWorker tally(protocol::WorkerId id, std::int64_t disagreed, std::int64_t outvoted) {
  return {.worker = {id, "a", "ho\nst", 7},
          .num_compared = 10,
          .num_disagreed = disagreed,
          .num_outvoted = outvoted};
}

TEST(RecheckTextTest, SaysNothingOfNothingAndOneSentenceOfAgreement) {
  EXPECT_THAT(remarks(RecheckRecord{}), IsEmpty());
  RecheckRecord record;
  record.num_rechecked = 12;
  record.workers[5] = tally(5, 0, 0);
  EXPECT_THAT(remarks(record), ElementsAre(HasSubstr("12 roll-outs were run again on another "
                                                     "worker: all answers agree")));
}

TEST(RecheckTextTest, NamesWhoIsOutvotedElseWhoDiffersAndClassesThatDiffer) {
  RecheckRecord record;
  record.num_rechecked = 12;
  record.num_disputed = 2;
  record.num_undecided = 1;
  record.workers[5] = tally(5, 2, 0);
  record.workers[6] = tally(6, 2, 0);
  EXPECT_THAT(remarks(record),
              ElementsAre(HasSubstr("2 of 12 roll-outs that were run again on another worker have "
                                    "answers that differ; of 1 no two workers tell"),
                          HasSubstr("worker 5 (ho"), HasSubstr("worker 6 (ho")));
  EXPECT_THAT(remarks(record)[1], ::testing::Not(HasSubstr("\n")));
  record.workers[6].num_outvoted = 2;
  record.classes[{"a", "b"}] = {.num_compared = 4, .num_disagreed = 1, .difference_max = .25};
  record.classes[{"a", "a"}] = {.num_compared = 4, .num_disagreed = 1, .difference_max = .5};
  EXPECT_THAT(
      remarks(record),
      ElementsAre(HasSubstr("2 of 12"),
                  HasSubstr("its results go to suspects.csv at the end, and treeroll-replay DIR "
                            "--without-worker 6 "),
                  HasSubstr("classes a and b differ in 1 of 4 comparisons, by 0.25")));
  const nlohmann::json json = to_json_value(record);
  EXPECT_EQ(json["workers"][1]["outvoted"], 2);
  EXPECT_EQ(json["classes"].size(), 2U);
}

}  // namespace
}  // namespace treeroll
