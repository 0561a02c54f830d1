#include "learner/study/toml_source.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>

#include "common/base/line_ends.h"
#include "learner/study/toml_depth.h"

namespace treeroll {
namespace {

using nlohmann::json;

[[noreturn]] void refuse(const std::string& location, const std::string& rule) {
  throw StudyError(location, ConfigError("", "", rule));
}

std::string read_file(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    refuse(name, error && error != std::errc::no_such_file_or_directory
                     ? "cannot be read: " + error.message()
                     : "no such file");
  }
  if (std::filesystem::is_directory(status)) refuse(name, "is a folder, must be a file");
  if (!std::filesystem::is_regular_file(status)) refuse(name, "must be a regular file");
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse(name, "cannot be read: " + std::generic_category().message(errno));
  std::string text;
  std::array<char, 16384> chunk;
  while (file && text.size() <= kStudyFileBytesMax) {
    file.read(chunk.data(), chunk.size());
    text.append(chunk.data(), static_cast<std::size_t>(file.gcount()));
  }
  if (file.bad()) refuse(name, "cannot be read: " + std::generic_category().message(errno));
  if (text.size() > kStudyFileBytesMax) {
    refuse(name, fmt::format("is too large: must be at most {} bytes", kStudyFileBytesMax));
  }
  if (bytes_beside_long_strings(text) > kStudyBytesMax) {
    refuse(name, fmt::format("is too large: must be at most {} bytes", kStudyBytesMax));
  }
  // Line ends change where files pass through other systems; what multi-line strings hold does not.
  return with_plain_line_ends(std::move(text));
}

/// Turns a toml++ document into JSON, noting where each key stands.
class Converter {
 public:
  /// @param file  what locations begin with; a document without lines (of the command line) is
  ///              located by this alone
  Converter(std::string file, bool has_lines) : file_(std::move(file)), has_lines_(has_lines) {
    origins_[""] = file_;
  }

  json convert(const toml::node& node, const std::string& path, int depth) {
    if (depth > kTomlDepthMax) {
      fail(path, node, fmt::format("is nested deeper than {} tables", kTomlDepthMax));
    }
    switch (node.type()) {
      case toml::node_type::table:
        return convert_table(*node.as_table(), path, depth);
      case toml::node_type::array:
        return convert_array(*node.as_array(), path, depth);
      case toml::node_type::integer:
        return node.as_integer()->get();
      case toml::node_type::floating_point:
        if (!std::isfinite(node.as_floating_point()->get())) {
          fail(path, node, "must be a finite number");
        }
        return node.as_floating_point()->get();
      case toml::node_type::boolean:
        return node.as_boolean()->get();
      case toml::node_type::string:
        return convert_string(node, path);
      default:
        fail(path, node, "is a date or time: no setting takes one");
    }
  }

  SettingOrigins take_origins() { return std::move(origins_); }

 private:
  json convert_table(const toml::table& table, const std::string& path, int depth) {
    json object = json::object();
    for (const auto& [key, node] : table) {
      const std::string below =
          path.empty() ? std::string(key.str()) : fmt::format("{}.{}", path, key.str());
      origins_[below] = location(key.source());
      object[std::string(key.str())] = convert(node, below, depth + 1);
    }
    return object;
  }

  json convert_array(const toml::array& array, const std::string& path, int depth) {
    json list = json::array();
    for (const toml::node& node : array) {
      const std::string below = fmt::format("{}[{}]", path, list.size());
      // Numbers are found by the line of their list; a map of each would be large.
      if (node.is_table()) origins_[below] = location(node.source());
      list.push_back(convert(node, below, depth + 1));
    }
    return list;
  }

  json convert_string(const toml::node& node, const std::string& path) {
    const std::string& text = node.as_string()->get();
    if (text.find('\0') != std::string::npos) fail(path, node, "must not hold a NUL character");
    return text;
  }

  std::string location(const toml::source_region& source) const {
    return has_lines_ ? fmt::format("{}:{}", file_, source.begin.line) : file_;
  }

  [[noreturn]] void fail(const std::string& path, const toml::node& node, const std::string& rule) {
    std::ostringstream shown;
    if (!node.is_table() && !node.is_array() && !node.is_string()) {
      node.visit([&](const auto& concrete) { shown << concrete; });
    }
    throw StudyError(location(node.source()), ConfigError(path, shown.str(), rule));
  }

  std::string file_;
  bool has_lines_;
  SettingOrigins origins_;
};

bool is_bare_key(std::string_view key) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  };
  return !key.empty() && std::all_of(key.begin(), key.end(), allowed);
}

/// A JSON string is a TOML string but for DEL, which TOML wants escaped.
std::string toml_string(const std::string& text) {
  std::string quoted;
  for (const char c : json(text).dump(-1, ' ', false, json::error_handler_t::replace)) {
    if (c == 0x7f) {
      quoted += "\\u007F";
    } else {
      quoted += c;
    }
  }
  return quoted;
}

/// What is longer stands on lines of its own.
constexpr std::size_t kShortStringMax = 120;

/// As a multi-line string: literally if it can stand so, else escaped line by line.
std::string long_toml_string(const std::string& text) {
  const bool is_plain = std::all_of(text.begin(), text.end(), [](char c) {
    return c == '\n' || (c >= ' ' && c <= '~' && c != '\'');
  });
  // A line break right behind the opening quotes does not count.
  if (is_plain) return "'''\n" + text + "'''";
  std::string quoted;
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = text.find('\n', begin);
    const std::string line = toml_string(text.substr(begin, end - begin));
    quoted += line.substr(1, line.size() - 2);
    if (end == std::string::npos) return "\"\"\"\n" + quoted + "\"\"\"";
    quoted += '\n';
    begin = end + 1;
  }
}

std::string toml_key(const std::string& key) { return is_bare_key(key) ? key : toml_string(key); }

std::string toml_float(double number) {
  std::string text = fmt::format("{}", number);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string inline_toml(const json& value) {
  if (value.is_string()) return toml_string(value.get<std::string>());
  if (value.is_number_float()) return toml_float(value.get<double>());
  if (!value.is_structured()) return value.dump();
  std::string text;
  for (const auto& [key, element] : value.items()) {
    if (!text.empty()) text += ", ";
    if (value.is_object()) text += toml_key(key) + " = ";
    text += inline_toml(element);
  }
  return value.is_object() ? "{" + text + "}" : "[" + text + "]";
}

}  // namespace

SettingOrigins read_toml_file(const std::filesystem::path& path, json& content,
                              std::string_view least, std::string* text_read) {
  const std::string name = path.string();
  std::string text = read_file(path);
  if (const int line = first_line_too_deep(text); line != 0) {
    refuse(fmt::format("{}:{}", name, line),
           fmt::format("is nested deeper than {} tables", kTomlDepthMax));
  }
  try {
    const toml::table document = toml::parse(text, name);
    if (document.empty()) refuse(name, fmt::format("is empty: must hold at least {}", least));
    Converter converter(name, true);
    content = converter.convert(document, "", 0);
    if (text_read) *text_read = std::move(text);
    return converter.take_origins();
  } catch (const toml::parse_error& error) {
    const toml::source_position where = error.source().begin;
    refuse(fmt::format("{}:{}:{}", name, where.line, where.column), error.what());
  }
}

SettingOverride parse_override(const std::string& argument) {
  const auto equals = argument.find('=');
  if (equals == std::string::npos) {
    throw StudyError(kCommandLineOrigin, ConfigError(argument, "", "must be KEY=VALUE"));
  }
  const std::string dotted = argument.substr(0, equals);
  SettingOverride setting{.key = {}, .text = argument.substr(equals + 1)};
  std::istringstream parts(dotted + ".");
  for (std::string part; std::getline(parts, part, '.');) {
    if (!is_bare_key(part) || setting.key.size() == kTomlDepthMax) {
      throw StudyError(kCommandLineOrigin,
                       ConfigError(argument, "", "must be KEY=VALUE, KEY like study.seed"));
    }
    setting.key.push_back(part);
  }
  return setting;
}

void parse_override_value(const SettingOverride& setting, json& value) {
  const std::string key = fmt::format("{}", fmt::join(setting.key, "."));
  const std::string& text = setting.text;
  const std::string document_text = "v = " + text;
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20; };
  if (text.size() > kStudyBytesMax || std::any_of(text.begin(), text.end(), is_control) ||
      first_line_too_deep(document_text) != 0) {
    throw StudyError(kCommandLineOrigin, ConfigError(key, "", "must be a single TOML value"));
  }
  try {
    const toml::table document = toml::parse(document_text);
    value = Converter(kCommandLineOrigin, false).convert(*document.get("v"), key, 0);
  } catch (const toml::parse_error& error) {
    // What begins like a string, list or table was meant as one.
    if (text.empty() || text.find_first_of("\"'[]{}#=") != std::string::npos) {
      throw StudyError(kCommandLineOrigin, ConfigError(key, text, error.what()));
    }
    value = text;
    try {
      static_cast<void>(value.dump());
    } catch (const json::type_error&) {
      throw StudyError(kCommandLineOrigin, ConfigError(key, "", "must be UTF-8 text"));
    }
  }
}

void append_toml(const json& table, const std::string& heading, std::string& text) {
  for (const auto& [key, value] : table.items()) {
    if (value.is_object()) continue;
    const bool is_long =
        value.is_string() && value.get_ref<const std::string&>().size() > kShortStringMax;
    text += fmt::format("{} = {}\n", toml_key(key),
                        is_long ? long_toml_string(value.get<std::string>()) : inline_toml(value));
  }
  for (const auto& [key, value] : table.items()) {
    if (!value.is_object()) continue;
    const std::string below = heading.empty() ? toml_key(key) : heading + "." + toml_key(key);
    text += fmt::format("[{}]\n", below);
    append_toml(value, below, text);
  }
}

}  // namespace treeroll
