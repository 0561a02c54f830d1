#include "common/files/secret_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <stdexcept>
#include <system_error>

namespace treeroll {
namespace {

class SecretDescriptor {
 public:
  explicit SecretDescriptor(const std::filesystem::path& path)
      : value_(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK)) {}
  ~SecretDescriptor() {
    if (value_ >= 0) close(value_);
  }
  SecretDescriptor(const SecretDescriptor&) = delete;
  SecretDescriptor& operator=(const SecretDescriptor&) = delete;
  int value() const { return value_; }

 private:
  int value_;
};

/// Of a service of systemd, in a folder that is the service's alone: an access list lets it read
/// what belongs to root, and shows as the group's bits.
bool is_credential(const std::filesystem::path& path, const struct stat& status) {
  const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
  if (folder == nullptr || status.st_uid != 0 || (status.st_mode & S_IRWXO) != 0) return false;
  std::error_code error;
  return std::filesystem::equivalent(path.parent_path(), folder, error);
}

}  // namespace

std::string read_secret_file(const std::filesystem::path& path, std::size_t bytes_max) {
  const auto fail = [&path](const std::string& rule) {
    throw std::runtime_error("cannot use " + path.string() + ": " + rule);
  };
  const auto fail_by_errno = [&] { fail(std::generic_category().message(errno)); };
  const SecretDescriptor file(path);
  if (file.value() < 0) fail_by_errno();
  struct stat status {};
  if (fstat(file.value(), &status) != 0) fail_by_errno();
  if (!S_ISREG(status.st_mode)) fail("must be a regular file");
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0 && !is_credential(path, status)) {
    fail("must be readable by its owner alone: chmod 600");
  }
  if (status.st_uid != geteuid() && status.st_uid != 0) {
    fail("must belong to the user of this process, or to root");
  }
  std::string content(bytes_max + 1, '\0');
  std::size_t num_read = 0;
  while (num_read < content.size()) {
    const ssize_t count = read(file.value(), &content[num_read], content.size() - num_read);
    if (count < 0) fail_by_errno();
    if (count == 0) break;
    num_read += static_cast<std::size_t>(count);
  }
  if (num_read > bytes_max) fail("must have at most " + std::to_string(bytes_max) + " bytes");
  content.resize(num_read);
  return content;
}

}  // namespace treeroll
