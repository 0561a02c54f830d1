#pragma once

#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/policy/policy_registry.h"
#include "learner/study/study_store.h"

namespace treeroll {

/// A start policy with its settings, defaults included.
struct ResolvedPolicy {
  StartPolicy start;
  std::shared_ptr<const nlohmann::json> settings;
  SignalNames signals = {};  ///< of one that is given
};

/// The start policies of a study by their [policy] tables: conditions often share one, and fitting
/// one takes time.
class PolicyCache {
 public:
  /// @param stored  what a resolved study holds of its starts; it and `registry` must outlive the
  ///                cache
  /// @param form    of the study
  PolicyCache(const PolicyRegistry& registry, const StudyStore& stored, StoredStarts starts,
              int form);

  /// Throws ConfigError, DemonstrationError or std::invalid_argument where there can be no such
  /// start. @return valid as long as the cache
  const ResolvedPolicy& get(const nlohmann::json& settings);

 private:
  ResolvedPolicy read(nlohmann::json settings) const;
  ResolvedPolicy read_given(const nlohmann::json& settings) const;

  const PolicyRegistry& registry_;
  const StudyStore& stored_;
  StoredStarts starts_;
  int form_;
  std::map<std::string, ResolvedPolicy> policies_;
};

}  // namespace treeroll
