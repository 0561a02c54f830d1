#include "common/policy/linear/basis_form.h"

#include <nlohmann/json.hpp>

namespace treeroll {

nlohmann::json RadialForm::content() const { return {{"range", {basis_.low(), basis_.high()}}}; }

nlohmann::json PrimitiveForm::content() const {
  return {{"range", {basis_.low(), basis_.high()}}, {"starts", starts_}};
}

}  // namespace treeroll
