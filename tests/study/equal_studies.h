#pragma once

#include <gtest/gtest.h>

#include <cstddef>

#include "common/policy/policy.h"
#include "learner/core/study.h"

namespace treeroll::study_test {

/// Equal to the last bit: policies are compared by their text, which is exact.
inline void expect_equal(const Study& a, const Study& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.seed, b.seed);
  EXPECT_EQ(a.repetitions, b.repetitions);
  EXPECT_EQ(a.in_sequence, b.in_sequence);
  EXPECT_EQ(a.stop_after, b.stop_after);
  EXPECT_EQ(a.final_evaluations, b.final_evaluations);
  EXPECT_EQ(a.discards_max, b.discards_max);
  ASSERT_EQ(a.conditions.size(), b.conditions.size());
  for (std::size_t i = 0; i < a.conditions.size(); ++i) {
    const Condition& first = a.conditions[i];
    const Condition& second = b.conditions[i];
    EXPECT_EQ(first.name, second.name);
    EXPECT_EQ(first.task_content, second.task_content) << first.name;
    EXPECT_EQ(first.exploration, second.exploration) << first.name;
    EXPECT_EQ(to_json(*first.start->at_layer(1)), to_json(*second.start->at_layer(1)))
        << first.name;
  }
}

}  // namespace treeroll::study_test
