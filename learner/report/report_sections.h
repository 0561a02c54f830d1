#pragma once

#include <vector>

#include "learner/report/document.h"
#include "learner/report/policy_terms.h"
#include "learner/report/statistics/claim.h"
#include "learner/report/statistics/comparison.h"
#include "learner/results/study_results.h"

namespace treeroll::report {

/// The parts of a report. Figures that do not exist are "-", failed runs are counted, never left
/// out.

/// A row a claim, with how many hold, do not, are inconclusive, are not measured.
/// @param figures  pictures of the document; a claim is linked to the one that its `figure` names,
///                 within its study, or else to its study
Section claims_section(const std::vector<Claim>& claims, const std::vector<ClaimResult>& results,
                       const std::vector<Picture>& figures);

/// Rewards of roll-outs and of the mean policy, failures and switches of a study's conditions.
/// @param remarks  sentences on the figures: what was left out of them
/// @param terms    a table of their own, if there are any
Section study_section(const StudyResults& study, const std::vector<Picture>& figures,
                      const std::vector<std::string>& remarks = {},
                      const std::vector<PolicyTerms>& terms = {});

/// The comparisons at the end of learning, Holm's correction over them, then p over roll-outs.
/// @param remarks  sentences below the table
Section comparison_section(const std::string& title, const std::vector<Comparison>& comparisons,
                           const std::vector<std::string>& remarks = {});

/// Every two conditions of a study that differ in one part of their names alone (pairs_of()), of
/// very many pairs the first.
std::vector<Comparison> comparisons_within(const StudyResults& study);
/// A sentence on the pairs that are too many for comparisons_within(); empty if none are.
std::string pairs_left_out(const StudyResults& study);
/// Conditions of the same name in both.
std::vector<Comparison> comparisons_between(const StudyResults& a, const StudyResults& b);

/// Everything as one JSON object: claims, studies, comparisons; null for what does not exist. A
/// study whose task names terms of its reward has "terms" too.
/// @param terms  of each study, or empty
std::string report_json(const std::vector<Claim>& claims, const std::vector<ClaimResult>& results,
                        const std::vector<StudyResults>& studies,
                        const std::vector<Comparison>& comparisons,
                        const std::vector<std::vector<PolicyTerms>>& terms = {});

}  // namespace treeroll::report
