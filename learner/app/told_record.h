#pragma once

#include <variant>

#include "learner/journal/journal_record.h"
#include "learner/web/views/live_study.h"

namespace treeroll {

/// Tells a page what a journal holds, as it is told what is written to one.
inline void tell(web::LiveStudy& study, const JournalRecord& record) {
  if (const auto* result = std::get_if<AcceptedResult>(&record)) study.accepted(*result);
  if (const auto* worker = std::get_if<KnownWorker>(&record)) study.accepted(*worker);
}

}  // namespace treeroll
