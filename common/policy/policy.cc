#include "common/policy/policy.h"

#include <nlohmann/json.hpp>

#include "common/policy/policy_text.h"

namespace treeroll {

std::string to_json(const Policy& policy) { return to_json(policy, {}); }

std::string to_json(const Policy& policy, const SignalNames& signals) {
  nlohmann::json out = policy.content();
  out["format"] = kPolicyFormat;
  out["version"] = kPolicyVersion;
  // Policies are known by the hash of their text: those of the first kind keep the text they had
  // before there were others.
  if (policy.kind() != kDefaultPolicyKind) out["kind"] = policy.kind();
  if (!signals.empty()) {
    out["signals"] = {{"inputs", signals.inputs}, {"outputs", signals.outputs}};
  }
  return out.dump();
}

}  // namespace treeroll
