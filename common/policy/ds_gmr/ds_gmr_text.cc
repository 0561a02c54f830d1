#include <nlohmann/json.hpp>

#include "common/policy/ds_gmr/ds_gmr_policy.h"
#include "common/policy/input_range.h"
#include "common/policy/tree/tree_policy.h"

namespace treeroll {

PolicyPtr ds_gmr_from_content(const PolicyText& content) {
  content.need_keys({"attractor", "range", "stiffness"});
  PolicyPtr attractor = tree_from_content(content.at("attractor"));
  if (attractor->input_dim() != 1) content.at("attractor").refuse("must have one input, the time");
  const PolicyText range = content.at("range");
  range.list_size(2, 2);
  const DsGmrPolicy::Pull pull{.low = range.at(0).number(),
                               .high = range.at(1).number(),
                               .stiffness = content.at("stiffness").number()};
  if (!is_input_range(pull.low, pull.high)) range.refuse(kInputRangeRule);
  if (!DsGmrPolicy::is_pull(pull)) content.at("stiffness").refuse(DsGmrPolicy::kPullRule);
  return std::make_shared<DsGmrPolicy>(std::move(attractor), pull);
}

nlohmann::json DsGmrPolicy::content() const {
  return {{"attractor", attractor_->content()},
          {"range", {pull_.low, pull_.high}},
          {"stiffness", pull_.stiffness}};
}

}  // namespace treeroll
