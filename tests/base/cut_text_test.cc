#include "common/base/cut_text.h"

#include <gtest/gtest.h>

namespace treeroll {
namespace {

TEST(CutTextTest, LeavesWhatIsShortEnough) {
  EXPECT_EQ(cut_text("", 0), "");
  EXPECT_EQ(cut_text("four", 4), "four");
}

TEST(CutTextTest, CutsAtABoundaryBetweenCharacters) {
  const std::string text = "a\u00e9\u20ac\U0001f600z";  // of 1, 2, 3, 4 and 1 bytes
  for (const auto& [bytes_max, size] :
       {std::pair{0, 0}, {1, 1}, {2, 1}, {3, 3}, {5, 3}, {6, 6}, {9, 6}, {10, 10}, {11, 11}}) {
    EXPECT_EQ(cut_text(text, static_cast<std::size_t>(bytes_max)),
              text.substr(0, static_cast<std::size_t>(size)))
        << bytes_max;
  }
}

TEST(CutTextTest, EndsOnBytesThatAreNoText) { EXPECT_EQ(cut_text("\x80\x80\x80\x80", 2), ""); }

}  // namespace
}  // namespace treeroll
