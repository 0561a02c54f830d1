#pragma once

#include <variant>
#include <vector>

#include "common/base/turn.h"
#include "common/protocol/messages.h"

/// What a relay core is told, and what it wants done. Above is the group of the learners, below
/// that of the workers.
namespace treeroll::relay {

// Events.

/// First event of all, once.
struct Started {};
struct MessageFromAbove {
  protocol::Message message;
};
struct MessageFromBelow {
  protocol::Message message;
};
/// Nothing more to read for now, on either side.
struct InboxDrained {};
struct TimerFired {};
/// SIGTERM, SIGINT or SIGHUP; the second one ends the relay at once.
struct DrainRequested {};

using Event = std::variant<Started, MessageFromAbove, MessageFromBelow, InboxDrained, TimerFired,
                           DrainRequested>;

// Effects, to be carried out in their order.

/// In a WorkerStatus the carrier sets receive_buffer_bytes and adds its own to num_rejected.
struct SendAbove {
  protocol::Message message;
};
struct SendBelow {
  protocol::Message message;
};
/// Last effect of all.
struct Exit {
  int status = 0;
};

using Effect = std::variant<SendAbove, SendBelow, LogLine, Exit>;
using Effects = std::vector<Effect>;

using Turn = treeroll::Turn<Effect>;

}  // namespace treeroll::relay
