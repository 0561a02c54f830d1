#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace treeroll::learner {

/// What a study may say of numeric classes, beside the name of one.
inline constexpr const char* kAnyClass = "any";
inline constexpr const char* kOneClass = "one";  ///< that of the first result

/// The numeric classes of the workers whose results a learner has accepted, and which it takes
/// results of. Workers of one class give the same bits for the same roll-out; those of two may not.
/// "" is the class of a worker that has not named one: no demand allows it, and nothing counts in
/// it. Workers of version 0.2.0 and before did not tell ODE's bits (" ode 1f2e3d4c" at the end of
/// the name): where such a class is demanded, those that tell them and are else of it are allowed;
/// of "one" the first of these decides from then on.
class NumericClasses {
 public:
  /// @param demand  kAnyClass, kOneClass or the name of a class
  explicit NumericClasses(std::string demand) : demand_(std::move(demand)) {}

  bool allows(const std::string& name) const;
  /// The class that is demanded; nothing while any will do.
  std::optional<std::string> demanded() const;

  /// A number for the class, or kUnknownClass for none and for one too many.
  int index(const std::string& name);

  /// A result of this class has been accepted.
  /// @return  whether it is the first of its class
  bool count(const std::string& name);
  /// Results by class, of those that the learner knows the workers of.
  const std::map<std::string, std::int64_t>& counts() const { return counts_; }

 private:
  std::string demand_;
  std::optional<std::string> first_;
  std::map<std::string, int> indices_;
  std::map<std::string, std::int64_t> counts_;
};

}  // namespace treeroll::learner
