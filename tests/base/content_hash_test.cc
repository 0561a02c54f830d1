#include "common/base/content_hash.h"

#include <gtest/gtest.h>

namespace treeroll {
namespace {

// From `printf abc | b2sum -l 128`.
TEST(ContentHashTest, IsBlake2bWith128Bits) {
  EXPECT_EQ(to_hex(content_hash("abc")), "cf4ab791c62b8d2b2109c90275287816");
}

TEST(ContentHashTest, DiffersWithTheContent) {
  EXPECT_EQ(content_hash("a"), content_hash("a"));
  EXPECT_NE(content_hash("a"), content_hash("b"));
  EXPECT_NE(short_form(content_hash("a")), short_form(content_hash("b")));
}

}  // namespace
}  // namespace treeroll
