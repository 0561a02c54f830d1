#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace treeroll {

inline constexpr std::string_view kPolicyFormat = "treeroll-policy";
inline constexpr int kPolicyVersion = 1;

/// A text that is no policy. Thrown while a policy's JSON is read, by its kind as well; leaves
/// PolicyRegistry::from_json() as an Error.
class PolicyTextError : public std::runtime_error {
 public:
  PolicyTextError(const std::string& place, const std::string& rule);
};

/// A value of a policy's JSON and where it stands. Text comes from outside: everything is checked,
/// and every refusal is a PolicyTextError that names the place and the rule.
///
///   policy.need_keys({"layer", "coefficients"});
///   const int layer = policy.at("layer").integer(1, 8);
///
/// Refers to the JSON it was made from, which must outlive it.
class PolicyText {
 public:
  PolicyText(const nlohmann::json& value, std::string path);

  [[noreturn]] void refuse(const std::string& rule) const;
  /// All keys and no others.
  void need_keys(const std::set<std::string>& keys) const;
  /// Precondition: need_keys() or list_size() has found that it is there.
  PolicyText at(const std::string& key) const;
  PolicyText at(std::size_t i) const;
  std::size_t list_size(std::size_t min, std::size_t max) const;
  double number() const;
  int integer(int min, int max) const;
  /// A list of at most so many strings.
  std::vector<std::string> strings(std::size_t max) const;
  /// @return  the index of the word
  std::size_t word(const std::vector<const char*>& words) const;
  struct Count {
    std::size_t min;
    std::size_t max;
  };
  /// A list of rows of numbers, all equally long.
  Eigen::MatrixXd rows(Count num_rows, Count num_columns) const;

 private:
  const nlohmann::json* value_;
  std::string path_;
};

/// A matrix as JSON: PolicyText::rows() reads it.
nlohmann::json json_rows(const Eigen::MatrixXd& numbers);

}  // namespace treeroll
