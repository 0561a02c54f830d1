#include "workers/app/packet.h"

#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>

#include "common/protocol/limits.h"
#include "common/transport/codec.h"

namespace treeroll::worker {
namespace {

constexpr std::byte kDefinitionMark{255};
static_assert(transport::kNumChannels < 255, "no channel is taken for the mark of a definition");

/// Closed at the end of its scope.
class File {
 public:
  explicit File(int descriptor) : descriptor_(descriptor) {}
  ~File() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int get() const { return descriptor_; }

 private:
  int descriptor_;
};

/// Room for one descriptor beside a packet.
union Control {
  cmsghdr header;
  char bytes[CMSG_SPACE(sizeof(int))];  // NOLINT: as the system has it
};

bool write_all(int file, std::string_view content) {
  for (std::size_t at = 0; at < content.size();) {
    const ssize_t count = write(file, content.data() + at, content.size() - at);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    at += static_cast<std::size_t>(count);
  }
  return true;
}

/// Nothing for a file that is no content.
std::optional<std::string> read_whole(int file) {
  struct stat facts {};
  if (fstat(file, &facts) != 0 || facts.st_size < 0 ||
      static_cast<std::size_t>(facts.st_size) > protocol::kDefinitionBytesMax) {
    return std::nullopt;
  }
  std::string content(static_cast<std::size_t>(facts.st_size), '\0');
  for (std::size_t at = 0; at < content.size();) {
    const ssize_t count =
        pread(file, content.data() + at, content.size() - at, static_cast<off_t>(at));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return std::nullopt;
    at += static_cast<std::size_t>(count);
  }
  return content;
}

/// @param file  goes along; -1: none
SendOutcome send_bytes(int socket, std::vector<std::byte>& packet, int file, bool wait) {
  iovec part{packet.data(), packet.size()};
  Control control{};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  if (file >= 0) {
    header.msg_control = control.bytes;
    header.msg_controllen = sizeof control.bytes;
    control.header.cmsg_level = SOL_SOCKET;
    control.header.cmsg_type = SCM_RIGHTS;
    control.header.cmsg_len = CMSG_LEN(sizeof file);
    std::memcpy(CMSG_DATA(&control.header), &file, sizeof file);
  }
  const int flags = MSG_NOSIGNAL | (wait ? 0 : MSG_DONTWAIT);
  while (sendmsg(socket, &header, flags) < 0) {
    if (errno == EINTR) continue;
    return errno == EAGAIN || errno == ENOBUFS ? SendOutcome::kFull : SendOutcome::kClosed;
  }
  return SendOutcome::kSent;
}

std::optional<DefinitionContent> definition_of(std::span<const std::byte> packet, int file) {
  DefinitionContent definition;
  auto& id = definition.name.id.bytes;
  if (packet.size() != 2 + id.size()) return std::nullopt;
  const auto kind = std::to_integer<int>(packet[1]);
  if (kind >= protocol::kNumDefinitionKinds) return std::nullopt;
  definition.name.kind = static_cast<protocol::DefinitionKind>(kind);
  std::ranges::transform(packet.subspan(2), id.begin(),
                         [](std::byte byte) { return std::to_integer<std::uint8_t>(byte); });
  if (file < 0) return definition;
  std::optional<std::string> content = read_whole(file);
  if (!content) return std::nullopt;
  definition.content = *std::move(content);
  return definition;
}

}  // namespace

SendOutcome send_packet(int socket, const protocol::Message& message, bool wait) {
  std::vector<std::byte> packet{static_cast<std::byte>(transport::channel_of(message))};
  const std::vector<std::byte> bytes = transport::encode(message);
  packet.insert(packet.end(), bytes.begin(), bytes.end());
  return send_bytes(socket, packet, -1, wait);
}

SendOutcome send_packet(int socket, const DefinitionContent& definition, bool wait) {
  std::vector<std::byte> packet{kDefinitionMark, static_cast<std::byte>(definition.name.kind)};
  for (const std::uint8_t byte : definition.name.id.bytes) packet.push_back(std::byte{byte});
  if (definition.content.empty()) return send_bytes(socket, packet, -1, wait);
  const File file(memfd_create("treeroll definition", MFD_CLOEXEC));
  // Without memory or descriptors for it the evaluator would wait for ever: it is given up.
  if (file.get() < 0 || !write_all(file.get(), definition.content)) return SendOutcome::kFull;
  return send_bytes(socket, packet, file.get(), wait);
}

Received receive_packet(int socket, bool wait) {
  Received received;
  // Made once: filling so much with zeros takes longer than a short packet.
  static thread_local std::vector<std::byte> packet(protocol::kMessageBytesMax + 1024);
  iovec part{packet.data(), packet.size()};
  Control control{};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control.bytes;
  header.msg_controllen = sizeof control.bytes;
  ssize_t size = 0;
  do {
    size = recvmsg(socket, &header, MSG_CMSG_CLOEXEC | (wait ? 0 : MSG_DONTWAIT));
  } while (size < 0 && errno == EINTR);
  if (size < 0 && errno == EAGAIN) return received;
  received.closed = size <= 0;
  if (received.closed) return received;
  int descriptor = -1;
  const cmsghdr* first = CMSG_FIRSTHDR(&header);
  if (first != nullptr && first->cmsg_type == SCM_RIGHTS) {
    std::memcpy(&descriptor, CMSG_DATA(first), sizeof descriptor);
  }
  const File file(descriptor);
  const auto bytes = std::span(packet).first(static_cast<std::size_t>(size));
  const auto channel = std::to_integer<int>(bytes[0]);
  const bool is_definition = bytes[0] == kDefinitionMark;
  const bool is_cut = (header.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) != 0;
  if (is_cut || (!is_definition && channel >= transport::kNumChannels)) {
    received.malformed = true;
  } else if (is_definition) {
    received.definition = definition_of(bytes, file.get());
    received.malformed = !received.definition;
  } else {
    auto message = transport::decode(static_cast<transport::Channel>(channel), bytes.subspan(1));
    received.malformed = !message;
    if (message) received.message = *std::move(message);
  }
  return received;
}

}  // namespace treeroll::worker
