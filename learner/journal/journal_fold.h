#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "common/base/time.h"
#include "learner/core/learner_core.h"
#include "learner/journal/journal_file.h"

namespace treeroll {

/// Brings a fresh core to where a journal ends: every result must answer the question that is drawn
/// again at its place, so every perturbation and every update is recomputed on the way.
/// @param study_id   hash of the study's text; a journal of another study is refused
/// @param on_record  called with each record once it is applied; may be empty
/// Throws std::runtime_error that names the journal, and for a difference its first record.
JournalTail fold_journal(const std::filesystem::path& journal, const ContentHash& study_id,
                         TimePoint now, learner::LearnerCore& core,
                         const std::function<void(const JournalRecord&)>& on_record = {});

/// What salvage has kept of a damaged journal.
struct Salvaged {
  std::int64_t num_records = 0;  ///< before the damage: kept
  std::uintmax_t bytes_kept = 0;
  std::uintmax_t bytes_lost = 0;
  std::string damage;           ///< what and where it was; empty: none, nothing was done
  std::filesystem::path whole;  ///< where the journal lies as it was
};

/// Copies a damaged journal aside (JOURNAL.damaged, .damaged2, ..) and keeps the part before the
/// damage. Throws std::runtime_error if it cannot. Precondition: the caller holds the journal's
/// lock (JournalWriter).
Salvaged salvage_journal(const std::filesystem::path& journal);

}  // namespace treeroll
