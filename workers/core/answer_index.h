#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/protocol/messages.h"

namespace treeroll::worker {

/// Where the answer to a question stands. Of thousands, looked up at each roll-out: a table by
/// hash, for a tree takes a dozen steps, each somewhere else in memory. It cannot be walked, so
/// nothing can depend on its order.
class AnswerIndex {
 public:
  using Question = std::pair<protocol::RolloutKey, std::int64_t>;  ///< a roll-out and its content

  /// Nothing if there is no such question.
  std::optional<std::int64_t> find(const Question& question) const;
  /// @return whether the question is new; the index is set in any case. Precondition: index > 0.
  bool set(const Question& question, std::int64_t index);
  /// Precondition: the question is there.
  void erase(const Question& question);
  std::size_t size() const { return size_; }

 private:
  struct Slot {
    Question question;
    std::int64_t index = 0;  ///< 0: free
  };

  /// Where the search for it begins: each next slot, until it is found or one is free.
  std::size_t home_of(const Question& question) const;
  std::size_t after(std::size_t place) const { return (place + 1) & (slots_.size() - 1); }
  /// Of the question, or of the free slot that ends the search. Precondition: there are slots.
  std::size_t place_of(const Question& question) const;
  void grow();

  std::vector<Slot> slots_;  ///< a power of two, half of them free
  std::size_t size_ = 0;
};

}  // namespace treeroll::worker
