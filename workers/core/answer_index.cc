#include "workers/core/answer_index.h"

#include "common/base/check.h"

namespace treeroll::worker {
namespace {

constexpr std::size_t kNumSlotsMin = 64;

}  // namespace

std::optional<std::int64_t> AnswerIndex::find(const Question& question) const {
  if (slots_.empty()) return std::nullopt;
  const Slot& slot = slots_[place_of(question)];
  return slot.index == 0 ? std::nullopt : std::optional(slot.index);
}

bool AnswerIndex::set(const Question& question, std::int64_t index) {
  CHECK(index > 0, "indices of answers begin at 1");
  if (2 * (size_ + 1) > slots_.size()) grow();
  Slot& slot = slots_[place_of(question)];
  const bool is_new = slot.index == 0;
  if (is_new) ++size_;
  slot = {question, index};
  return is_new;
}

/// What stands behind it moves up where its own search would else end too soon.
void AnswerIndex::erase(const Question& question) {
  CHECK(!slots_.empty(), "a question that is not there");
  std::size_t hole = place_of(question);
  CHECK(slots_[hole].index != 0, "a question that is not there");
  const std::size_t mask = slots_.size() - 1;
  for (std::size_t at = after(hole); slots_[at].index != 0; at = after(at)) {
    const std::size_t way_to_it = (at - home_of(slots_[at].question)) & mask;
    const std::size_t way_from_hole = (at - hole) & mask;
    if (way_to_it < way_from_hole) continue;
    slots_[hole] = slots_[at];
    hole = at;
  }
  slots_[hole] = {};
  --size_;
}

/// The content is a hash of all that is asked; runs and numbers are small, so they are spread.
std::size_t AnswerIndex::home_of(const Question& question) const {
  constexpr std::uint64_t kSpread = 0x9e3779b97f4a7c15U;  // 2^64 over the golden ratio
  const auto& [key, content] = question;
  std::uint64_t mixed = static_cast<std::uint64_t>(static_cast<std::uint32_t>(key.run)) << 32U;
  mixed ^= static_cast<std::uint32_t>(key.number);
  mixed = (mixed ^ static_cast<std::uint64_t>(content)) * kSpread;
  return static_cast<std::size_t>(mixed >> 32U) & (slots_.size() - 1);
}

std::size_t AnswerIndex::place_of(const Question& question) const {
  std::size_t place = home_of(question);
  while (slots_[place].index != 0 && slots_[place].question != question) place = after(place);
  return place;
}

void AnswerIndex::grow() {
  const std::vector<Slot> before =
      std::exchange(slots_, std::vector<Slot>(slots_.empty() ? kNumSlotsMin : 2 * slots_.size()));
  for (const Slot& slot : before) {
    if (slot.index != 0) slots_[place_of(slot.question)] = slot;
  }
}

}  // namespace treeroll::worker
