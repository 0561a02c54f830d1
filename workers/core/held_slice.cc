#include "workers/core/held_slice.h"

#include <algorithm>

#include "common/base/check.h"

namespace treeroll::worker {

using protocol::kFirstKey;
using protocol::kLastKey;
using protocol::RolloutKey;

RolloutKey HeldSlice::next() const {
  if (last == kLastKey) return kFirstKey;
  if (last.number == kLastKey.number) return {last.run + 1, kFirstKey.number};
  return {last.run, last.number + 1};
}

HeldSlice slice_of(const std::vector<RolloutKey>& held, RolloutKey from, std::size_t num_max) {
  CHECK(num_max > 0, "a slice of nothing");
  if (held.size() <= num_max) from = kFirstKey;
  HeldSlice slice;
  slice.first = from;
  const auto begin = std::lower_bound(held.begin(), held.end(), from);
  const auto num_left = static_cast<std::size_t>(held.end() - begin);
  const auto end = begin + static_cast<std::ptrdiff_t>(std::min(num_left, num_max));
  slice.keys.assign(begin, end);
  if (end != held.end()) slice.last = slice.keys.back();
  return slice;
}

}  // namespace treeroll::worker
