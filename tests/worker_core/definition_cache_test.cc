#include "workers/core/definition_cache.h"

#include <gtest/gtest.h>

#include "common/protocol/limits.h"

namespace treeroll::worker {
namespace {

ContentHash id(const char* name) { return content_hash(std::string_view(name)); }

TEST(DefinitionCacheTest, DropsTheLeastRecentlyUsedWhenItIsFull) {
  DefinitionCache cache(2, 1000);
  ASSERT_NE(cache.insert(id("a"), "a", {}), nullptr);
  ASSERT_NE(cache.insert(id("b"), "b", {}), nullptr);
  cache.touch(id("a"));
  ASSERT_NE(cache.insert(id("c"), "c", {}), nullptr);
  EXPECT_NE(cache.find(id("a")), nullptr);
  EXPECT_EQ(cache.find(id("b")), nullptr);
  EXPECT_EQ(cache.num_evicted(), 1);
}

TEST(DefinitionCacheTest, NeverDropsWhatIsInUseOrBeingChecked) {
  DefinitionCache cache(2, 1000);
  cache.insert(id("a"), "a", {});
  cache.insert(id("b"), "b", {})->state = DefinitionState::kChecking;
  EXPECT_EQ(cache.insert(id("c"), "c", {id("a")}), nullptr);
  EXPECT_EQ(cache.size(), 2U);
}

TEST(DefinitionCacheTest, CutsALongReason) {
  DefinitionCache cache(2, 100);
  cache.insert(id("a"), "a", {});
  cache.refuse(*cache.find(id("a")), std::string(60'000, 'x'));
  EXPECT_EQ(cache.find(id("a"))->text, std::string(protocol::kReasonBytesMax, 'x'));
}

TEST(DefinitionCacheTest, BoundsItsBytesAndGivesThoseOfRefusedOnesBack) {
  DefinitionCache cache(100, 10);
  EXPECT_EQ(cache.insert(id("x"), "eleven byte", {}), nullptr);
  cache.insert(id("a"), "123456", {});
  cache.insert(id("b"), "1234", {});
  EXPECT_EQ(cache.bytes(), 10U);
  cache.refuse(*cache.find(id("b")), "no");
  EXPECT_EQ(cache.bytes(), 6U);
  ASSERT_NE(cache.insert(id("c"), "1234", {}), nullptr);
  EXPECT_NE(cache.find(id("a")), nullptr);
  cache.insert(id("d"), "12345", {});
  EXPECT_EQ(cache.find(id("a")), nullptr);
  EXPECT_EQ(cache.bytes(), 9U);
}

}  // namespace
}  // namespace treeroll::worker
