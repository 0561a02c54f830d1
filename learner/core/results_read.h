#pragma once

#include <cstdint>
#include <map>

namespace treeroll::learner {

/// Which results of one worker have been read, by their index: all up to one, and stretches past
/// those that are missing yet.
class ResultsRead {
 public:
  /// These have been read. Past kStretchesReadMax stretches the one furthest on is forgotten, so
  /// that its worker repeats it. Precondition: first <= last.
  void note(std::int64_t first, std::int64_t last);
  /// Its worker gives none before this one any more.
  void forget_before(std::int64_t oldest);

  /// All up to this one have been read, or do not come any more.
  std::int64_t last_without_gap() const { return last_without_gap_; }
  bool contains(std::int64_t index) const;

 private:
  void close_gaps();

  std::int64_t last_without_gap_ = 0;
  std::map<std::int64_t, std::int64_t> stretches_;  // first and last; apart from each other
};

}  // namespace treeroll::learner
