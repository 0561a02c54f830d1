#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/policy/policy.h"
#include "common/policy/policy_text.h"

namespace treeroll {

class SettingsReader;

/// What a study begins with.
struct StartPolicy {
  PolicyPtr policy;
  /// Of a fit: log-likelihood per sample of the demonstration, layer by layer, coarse to fine.
  std::vector<double> log_likelihoods = {};
  /// What it was fitted to: d x N, columns are observations; null for one that was given.
  std::shared_ptr<const Eigen::MatrixXd> demonstration = {};
  /// The demonstration as CSV text, if it came from files; settings name it by its content_hash().
  std::string demonstration_text = {};
};

/// A policy, and what its text calls its inputs and outputs; empty: it names none.
struct NamedPolicy {
  PolicyPtr policy;
  SignalNames signals;
};

/// Gives the text of a file that settings name. The caller's, for a core reads no disk.
using FileReader = std::function<std::string(const std::string& file)>;

/// What settings only name, or what was made of them before.
struct StartSources {
  /// Of the study that the settings are from, resolved_study.h: defaults may have changed since.
  int form = std::numeric_limits<int>::max();
  FileReader read_file = {};  ///< may be empty: then there are no files
  /// The CSV text of a demonstration by its content; may be empty: then none is known by it.
  FileReader find_demonstration = {};
  /// What an earlier fit by these very settings has given: nothing is fitted again. May be null.
  const StartPolicy* fitted = nullptr;
};

/// Makes a policy from Policy::content(). Throws PolicyTextError: the text comes from outside.
using PolicyMaker = std::function<PolicyPtr(const PolicyText& content)>;

/// Makes the start policy that the [policy] table of a study describes; its key "kind" has been
/// read. Throws ConfigError. Does not call finish(): the caller does.
using StartReader = std::function<StartPolicy(SettingsReader& policy, const StartSources& sources)>;

/// The kinds of policies a program knows, by name.
///
///   registry.add("polynomial", polynomial_from_content, read_polynomial_start);
class PolicyRegistry {
 public:
  /// @param start  may be empty for a kind whose start takes more than its own room has: then
  ///               set_start() follows where that is at hand
  /// Precondition: the name is new and not empty.
  void add(std::string kind, PolicyMaker make, StartReader start);
  /// Precondition: the kind is known and has no way to start yet.
  void set_start(std::string_view kind, StartReader start);
  /// A name that a study may give in place of a kind: the start is one of the kinds known.
  /// Precondition: the name is new and not empty.
  void add_choice(std::string name, StartReader start);

  /// The policy of a text that to_json() wrote, to the bit. An Error names the place and the rule.
  Result<PolicyPtr> from_json(std::string_view text) const;
  /// The same with the names that the text has for its inputs and outputs.
  Result<NamedPolicy> named_from_json(std::string_view text) const;
  /// Reads the [policy] table of a study, its key "kind" included. As a StartReader.
  StartPolicy read_start(SettingsReader& policy, const StartSources& sources) const;

 private:
  struct Kind {
    PolicyMaker make;  ///< empty: a choice, of which there are no texts
    StartReader start;
  };
  NamedPolicy read(std::string_view text) const;
  std::string known() const;  ///< kinds that a text may have

  std::map<std::string, Kind, std::less<>> kinds_;
};

}  // namespace treeroll
