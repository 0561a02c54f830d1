#include "learner/study/policy_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

#include "common/base/config_error.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPolicyBytesMax = std::size_t{1} << 20;

}  // namespace

PolicyFile read_policy_file(const std::string& key, const fs::path& path,
                            const PolicyRegistry& policies) {
  const auto refuse = [&](const std::string& rule) { throw ConfigError(key, path.string(), rule); };
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) refuse("no such file");
  if (status.type() == fs::file_type::none) refuse("cannot be read: " + error.message());
  if (fs::is_directory(status)) refuse("is a folder, must be a policy file");
  if (!fs::is_regular_file(status)) refuse("must be a regular file");
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse("cannot be read: " + std::generic_category().message(errno));
  std::string text(kPolicyBytesMax + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) refuse("cannot be read: " + std::generic_category().message(errno));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kPolicyBytesMax) {
    refuse(fmt::format("is too large: must be at most {} bytes", kPolicyBytesMax));
  }
  Result<NamedPolicy> named = policies.named_from_json(text);
  if (!named) refuse(named.error().message);
  return {std::move(text), std::move(named->policy), std::move(named->signals)};
}

}  // namespace treeroll
