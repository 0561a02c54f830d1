// Packets are lost between the hosts; what is learnt stays the same to the bit.
#include "tests/end_to_end/loss_test.h"

namespace treeroll::end_to_end {
namespace {

TEST_F(LossTest, TheSwingUpIsLearntToTheSameBitsAtAnyLoss) {
  expect_one_result_at_any_loss(swing_up_study(10));
}

TEST_F(LossTest, ShortRolloutsAreLearntToTheSameBitsAtAnyLoss) {
  expect_one_result_at_any_loss(synthetic_study(100, 50));
}

}  // namespace
}  // namespace treeroll::end_to_end
