#include "learner/core/numeric_classes.h"

#include "common/protocol/limits.h"
#include "learner/core/answer.h"

namespace treeroll::learner {

namespace {

/// Workers of before did not say what ODE's bits are on their host: the rest of the name is one of
/// theirs.
constexpr const char* kOdeMark = " ode ";

bool says_more_than(const std::string& name, const std::string& of_before) {
  return of_before.find(kOdeMark) == std::string::npos && name.starts_with(of_before + kOdeMark);
}

}  // namespace

std::optional<std::string> NumericClasses::demanded() const {
  if (demand_ == kAnyClass) return std::nullopt;
  return demand_ == kOneClass ? first_ : demand_;
}

bool NumericClasses::allows(const std::string& name) const {
  if (demand_ == kAnyClass) return true;
  const std::optional<std::string> one = demanded();
  return !name.empty() && (!one || *one == name || says_more_than(name, *one));
}

int NumericClasses::index(const std::string& name) {
  if (name.empty()) return kUnknownClass;
  const bool is_full = indices_.size() >= protocol::kNumericClassesMax;
  if (is_full && !indices_.contains(name)) return kUnknownClass;
  return indices_.emplace(name, static_cast<int>(indices_.size())).first->second;
}

bool NumericClasses::count(const std::string& name) {
  if (name.empty()) return false;
  if (!first_ || says_more_than(name, *first_)) first_ = name;
  const bool is_full = counts_.size() >= protocol::kNumericClassesMax;
  if (is_full && !counts_.contains(name)) return false;
  return ++counts_[name] == 1;
}

}  // namespace treeroll::learner
