#include "common/transport/codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/check.h"
#include "common/protocol/limits.h"
#include "common/transport/wire_check.h"
#include "common/transport/wire_fields.h"

namespace treeroll::transport {
namespace {

using protocol::Message;
using wire::Fields;

// Visitors of wire_fields.h: from a message to its LCM type, and back.
struct ToWire {
  template <class M, class W>
  void copy(const M& m, W& w) {
    w = m;
  }
  void count(const char*, auto& m, auto& w) { copy(m, w); }
  void bounded(const char*, auto& m, auto& w, std::int64_t) { copy(m, w); }
  void integer(const char*, auto& m, auto& w) { copy(m, w); }
  void number(const char*, auto& m, auto& w) { copy(m, w); }
  void flag(const char*, auto& m, auto& w) { copy(m, w); }
  void outcome(const Outcome& m, auto& reward, auto& status, auto& reason, std::size_t) {
    reward = m.reward();
    status = static_cast<std::int8_t>(m.status());
    reason = m.reason();
  }
  void kind(const char*, auto& m, auto& w) { w = static_cast<std::int8_t>(m); }
  void hash(const char*, auto& m, auto& w) { std::ranges::copy(m.bytes, w); }
  void text(const char*, auto& m, auto& w, std::size_t) { copy(m, w); }
  template <class M>
  void record(const char*, M& m, auto& w) {
    Fields<std::remove_const_t<M>>::visit(*this, m, w);
  }
  template <class M>
  void records(const char* name, M& m, auto& size, auto& w, int) {
    size = static_cast<std::int32_t>(m.size());
    w.resize(m.size());
    for (std::size_t i = 0; i < m.size(); ++i) record(name, m[i], w[i]);
  }
  void numbers(const char*, auto& m, auto& size, auto& w, int) {
    size = static_cast<std::int32_t>(m.size());
    copy(m, w);
  }
  void integers(const char*, auto& m, auto& size, auto& w, int, int) {
    size = static_cast<std::int32_t>(m.size());
    copy(m, w);
  }
  void maybe_hash(const char*, auto& m, auto& size, auto& w) {
    size = m ? 1 : 0;
    if (m) w.emplace_back(m->bytes.begin(), m->bytes.end());
  }
  void bytes(const char*, auto& m, auto& size, auto& w, std::size_t) {
    size = static_cast<std::int32_t>(m.size());
    w.assign(m.begin(), m.end());
  }
  void word_macs(const char*, auto& size, auto&, int) { size = 0; }
  void signature(auto& key_id, auto& signed_index, auto& mac) {
    key_id = 0;
    signed_index = 0;
    std::ranges::fill(mac, std::uint8_t{0});
  }
};

struct FromWire {
  void count(const char*, auto& m, auto& w) { m = w; }
  void bounded(const char*, auto& m, auto& w, std::int64_t) { m = w; }
  void integer(const char*, auto& m, auto& w) { m = w; }
  void number(const char*, auto& m, auto& w) { m = w; }
  void flag(const char*, auto& m, auto& w) { m = w != 0; }
  void outcome(Outcome& m, auto& reward, auto& status, auto& reason, std::size_t) {
    m = Outcome(reward, static_cast<RolloutStatus>(status), std::move(reason));
  }
  void kind(const char*, auto& m, auto& w) { m = static_cast<protocol::DefinitionKind>(w); }
  void hash(const char*, auto& m, auto& w) { std::ranges::copy(w, m.bytes.begin()); }
  void text(const char*, auto& m, auto& w, std::size_t) { m = std::move(w); }
  template <class M>
  void record(const char*, M& m, auto& w) {
    Fields<M>::visit(*this, m, w);
  }
  void records(const char* name, auto& m, auto&, auto& w, int) {
    m.resize(w.size());
    for (std::size_t i = 0; i < w.size(); ++i) record(name, m[i], w[i]);
  }
  void numbers(const char*, auto& m, auto&, auto& w, int) { m = std::move(w); }
  void integers(const char*, auto& m, auto&, auto& w, int, int) { m = std::move(w); }
  void maybe_hash(const char* name, auto& m, auto&, auto& w) {
    if (!w.empty()) hash(name, m.emplace(), w[0]);
  }
  void bytes(const char*, auto& m, auto&, auto& w, std::size_t) { m.assign(w.begin(), w.end()); }
  void word_macs(const char*, auto&, auto&, int) {}
  void signature(auto&, auto&, auto&) {}
};

template <class M>
std::optional<std::string> check_as(std::span<const std::byte> bytes) {
  using Wire = typename Fields<M>::Wire;
  std::string_view type = Wire::getTypeName();
  type.remove_suffix(2);  // "_t"
  const std::string name(type);
  if (bytes.size() > protocol::kMessageBytesMax) {
    return fmt::format("{}: {} bytes are more than {}", name, bytes.size(),
                       protocol::kMessageBytesMax);
  }
  wire::Checker checker(name.c_str(), bytes);
  checker.fingerprint(Wire::getHash());
  M message;
  Wire wire;
  Fields<M>::visit(checker, message, wire);
  checker.end();
  return checker.refusal();
}

template <class M>
Result<Message> decode_as(std::span<const std::byte> bytes) {
  if (auto refusal = check_as<M>(bytes)) return Error{std::move(*refusal)};
  typename Fields<M>::Wire wire;
  const int size = static_cast<int>(bytes.size());
  CHECK(wire.decode(bytes.data(), 0, size) == size,
        "lcm-gen's decode refuses what the checker has let through");
  M message;
  FromWire from_wire;
  Fields<M>::visit(from_wire, message, wire);
  return Message(std::move(message));
}

/// Calls `function` with the message type of a channel: function.template operator()<M>().
template <class Answer, class Function>
Answer with_type_of(Channel channel, Function function) {
  return [&]<std::size_t... I>(std::index_sequence<I...>) {
    using Entry = Answer (*)(Function&);
    static constexpr std::array<Entry, kNumChannels> kEntries = {[](Function& f) -> Answer {
      return f.template operator()<std::variant_alternative_t<I, Message>>();
    }...};
    return kEntries.at(static_cast<std::size_t>(channel))(function);
  }
  (std::make_index_sequence<kNumChannels>());
}

}  // namespace

std::vector<std::byte> encode(const Message& message) {
  return std::visit(
      []<class M>(const M& m) {
        typename Fields<M>::Wire wire;
        ToWire to_wire;
        Fields<M>::visit(to_wire, m, wire);
        std::vector<std::byte> bytes(static_cast<std::size_t>(wire.getEncodedSize()));
        const int size = static_cast<int>(bytes.size());
        CHECK(wire.encode(bytes.data(), 0, size) == size, "lcm-gen's encode fills its own size");
        return bytes;
      },
      message);
}

std::optional<std::string> refusal(Channel channel, std::span<const std::byte> bytes) {
  return with_type_of<std::optional<std::string>>(channel,
                                                  [&]<class M>() { return check_as<M>(bytes); });
}

Result<Message> decode(Channel channel, std::span<const std::byte> bytes) {
  return with_type_of<Result<Message>>(channel, [&]<class M>() { return decode_as<M>(bytes); });
}

}  // namespace treeroll::transport
