#include "common/transport/short_frame.h"

#include <algorithm>
#include <cstdint>
#include <string>

#include "common/base/check.h"

namespace treeroll::transport {
namespace {

constexpr std::uint32_t kMagic = 0x4c433032;  // 'LC02'
constexpr std::size_t kHeaderBytes = 8;
constexpr std::size_t kChannelBytesMax = 63;

// A filter on a UDP socket sees the packet from its UDP header on.
constexpr std::uint32_t kUdpHeaderBytes = 8;
constexpr std::uint32_t kMagicOffset = kUdpHeaderBytes;
constexpr std::uint32_t kChannelOffset = kUdpHeaderBytes + kHeaderBytes;

constexpr std::uint32_t kPass = 0xffffffff;
constexpr std::uint32_t kDrop = 0;

/// `size` bytes of the text as the kernel loads them: big-endian.
std::uint32_t load(std::string_view text, std::size_t at, std::size_t size) {
  std::uint32_t value = 0;
  for (std::size_t i = at; i < at + size; ++i) {
    value = value << 8 | static_cast<unsigned char>(text[i]);
  }
  return value;
}

std::uint16_t load_instruction(std::size_t size) {
  return BPF_LD | BPF_ABS | (size == 4 ? BPF_W : size == 2 ? BPF_H : BPF_B);
}

/// Tests bytes [from, text.size()) of the channel; falls through where they are equal and jumps
/// past `num_after` further instructions where they are not.
std::vector<sock_filter> compare(std::string_view text, std::size_t from, std::size_t num_after) {
  struct Piece {
    std::size_t at;
    std::size_t size;
  };
  std::vector<Piece> pieces;
  for (std::size_t at = from; at < text.size();) {
    const std::size_t left = text.size() - at;
    pieces.push_back({at, left >= 4 ? std::size_t{4} : left >= 2 ? std::size_t{2} : 1});
    at += pieces.back().size;
  }
  std::vector<sock_filter> program;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const auto [at, size] = pieces[i];
    const std::size_t to_jump = 2 * (pieces.size() - i - 1) + num_after;
    CHECK(to_jump <= 255, "a jump of a socket filter spans at most 255 instructions");
    program.push_back(
        BPF_STMT(load_instruction(size), kChannelOffset + static_cast<std::uint32_t>(at)));
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, load(text, at, size), 0,
                               static_cast<std::uint8_t>(to_jump)));
  }
  return program;
}

void append(std::vector<sock_filter>& program, const std::vector<sock_filter>& more) {
  program.insert(program.end(), more.begin(), more.end());
}

}  // namespace

std::optional<ShortFrame> read_short_frame(std::span<const std::byte> datagram) {
  if (datagram.size() < kHeaderBytes) return std::nullopt;
  const std::string_view text(reinterpret_cast<const char*>(datagram.data()), datagram.size());
  if (load(text, 0, 4) != kMagic) return std::nullopt;
  const std::string_view rest = text.substr(kHeaderBytes);
  const std::size_t nul = rest.substr(0, kChannelBytesMax + 1).find('\0');
  if (nul == std::string_view::npos) return std::nullopt;
  return ShortFrame{rest.substr(0, nul), datagram.subspan(kHeaderBytes + nul + 1)};
}

std::vector<sock_filter> short_frame_filter(std::span<const Channel> channels) {
  // A load past the end of the packet drops it: every message of ours is longer than the longest
  // name, so none of them is dropped while it is compared with another's.
  const sock_filter pass = BPF_STMT(BPF_RET | BPF_K, kPass);
  const sock_filter drop = BPF_STMT(BPF_RET | BPF_K, kDrop);
  std::vector<sock_filter> program = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kMagicOffset),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kMagic, 1, 0),
      drop,
  };
  std::vector<sock_filter> prefix = compare(kChannelPrefix, 0, 1);
  append(program, prefix);
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JA, 1, 0, 0));  // over the drop
  program.push_back(drop);
  for (const Channel channel : channels) {
    const std::string_view name = channel_name(channel);
    CHECK(name.starts_with(kChannelPrefix), "channel names begin with the common prefix");
    // With the closing NUL: one name may be the beginning of another.
    append(program,
           compare(std::string_view(name.data(), name.size() + 1), kChannelPrefix.size(), 1));
    program.push_back(pass);
  }
  program.push_back(drop);
  return program;
}

}  // namespace treeroll::transport
