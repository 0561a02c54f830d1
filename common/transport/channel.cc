#include "common/transport/channel.h"

#include <array>
#include <cstddef>
#include <utility>

#include "common/transport/wire_fields.h"

namespace treeroll::transport {
namespace {

using protocol::Message;

template <std::size_t... I>
constexpr auto channel_names(std::index_sequence<I...>) {
  using wire::Fields;
  static_assert(
      ((Fields<std::variant_alternative_t<I, Message>>::kChannel == static_cast<Channel>(I)) &&
       ...),
      "the alternatives of Message stand in the order of Channel");
  static_assert((std::string_view(Fields<std::variant_alternative_t<I, Message>>::kChannelName)
                     .starts_with(kChannelPrefix) &&
                 ...),
                "the kernel's filter lets no other name pass");
  return std::array{Fields<std::variant_alternative_t<I, Message>>::kChannelName...};
}

constexpr auto kChannelNames = channel_names(std::make_index_sequence<kNumChannels>());

}  // namespace

const char* channel_name(Channel channel) {
  return kChannelNames.at(static_cast<std::size_t>(channel));
}

Channel channel_of(const Message& message) { return static_cast<Channel>(message.index()); }

}  // namespace treeroll::transport
