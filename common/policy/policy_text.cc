#include "common/policy/policy_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

namespace treeroll {
namespace {

using nlohmann::json;

std::string shown(const json& value) {
  constexpr std::size_t kLengthMax = 60;
  std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() > kLengthMax) text = text.substr(0, kLengthMax) + "...";
  return text;
}

}  // namespace

PolicyTextError::PolicyTextError(const std::string& place, const std::string& rule)
    : std::runtime_error(fmt::format("policy: {} {}", place, rule)) {}

PolicyText::PolicyText(const json& value, std::string path)
    : value_(&value), path_(std::move(path)) {}

void PolicyText::refuse(const std::string& rule) const {
  throw PolicyTextError(path_, fmt::format("is {}: {}", shown(*value_), rule));
}

void PolicyText::need_keys(const std::set<std::string>& keys) const {
  if (!value_->is_object()) refuse("must be an object");
  for (const auto& [key, unused] : value_->items()) {
    if (!keys.contains(key)) throw PolicyTextError(path_ + "." + key, "is an unknown key");
  }
  for (const std::string& key : keys) {
    if (!value_->contains(key)) {
      throw PolicyTextError(path_ + "." + key, "is required and missing");
    }
  }
}

PolicyText PolicyText::at(const std::string& key) const {
  return {value_->at(key), path_ + "." + key};
}

PolicyText PolicyText::at(std::size_t i) const {
  return {value_->at(i), fmt::format("{}[{}]", path_, i)};
}

std::size_t PolicyText::list_size(std::size_t min, std::size_t max) const {
  if (!value_->is_array()) refuse("must be a list");
  const std::size_t size = value_->size();
  if (size < min || size > max) {
    throw PolicyTextError(
        path_, min == max
                   ? fmt::format("holds {} elements, must hold {}", size, min)
                   : fmt::format("holds {} elements, must hold from {} to {}", size, min, max));
  }
  return size;
}

double PolicyText::number() const {
  if (!value_->is_number()) refuse("must be a number");
  return value_->get<double>();
}

int PolicyText::integer(int min, int max) const {
  // Through double: it holds every int and cannot wrap round.
  if (!value_->is_number_integer() ||
      !(value_->get<double>() >= min && value_->get<double>() <= max)) {
    refuse(fmt::format("must be an integer from {} to {}", min, max));
  }
  return value_->get<int>();
}

std::vector<std::string> PolicyText::strings(std::size_t max) const {
  std::vector<std::string> list(list_size(0, max));
  for (std::size_t i = 0; i < list.size(); ++i) {
    const json& element = value_->at(i);
    if (!element.is_string()) at(i).refuse("must be a string");
    list[i] = element.get<std::string>();
  }
  return list;
}

std::size_t PolicyText::word(const std::vector<const char*>& words) const {
  for (std::size_t i = 0; value_->is_string() && i < words.size(); ++i) {
    if (value_->get_ref<const std::string&>() == words[i]) return i;
  }
  refuse(fmt::format("must be one of: {}", fmt::join(words, ", ")));
}

Eigen::MatrixXd PolicyText::rows(Count num_rows, Count num_columns) const {
  const std::size_t size = list_size(num_rows.min, num_rows.max);
  const std::size_t columns = at(0).list_size(num_columns.min, num_columns.max);
  Eigen::MatrixXd numbers(size, columns);
  for (std::size_t o = 0; o < size; ++o) {
    const PolicyText row = at(o);
    row.list_size(columns, columns);
    for (std::size_t i = 0; i < columns; ++i) {
      numbers(static_cast<Eigen::Index>(o), static_cast<Eigen::Index>(i)) = row.at(i).number();
    }
  }
  return numbers;
}

nlohmann::json json_rows(const Eigen::MatrixXd& numbers) {
  nlohmann::json rows = nlohmann::json::array();
  for (Eigen::Index o = 0; o < numbers.rows(); ++o) {
    const Eigen::RowVectorXd row = numbers.row(o);
    rows.push_back(std::vector<double>(row.begin(), row.end()));
  }
  return rows;
}

}  // namespace treeroll
