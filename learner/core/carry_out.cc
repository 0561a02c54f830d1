#include "learner/core/carry_out.h"

#include <utility>

namespace treeroll::learner {

void carry_out(const Effects& effects, EffectHandler& handler) {
  for (const Effect& effect : effects) {
    const auto* result = std::get_if<AppendResult>(&effect);
    const auto* second = std::get_if<AppendSecond>(&effect);
    const auto* worker = std::get_if<AppendWorker>(&effect);
    const auto* signals = std::get_if<AppendSignals>(&effect);
    const auto* time = std::get_if<AppendTime>(&effect);
    if (result) handler.append(result->result);
    if (second) handler.append(second->answer);
    if (worker) handler.append(worker->worker);
    if (signals) handler.append(signals->signals);
    if (time) handler.append(time->time);
  }
  bool flushed = false;
  for (const Effect& effect : effects) {
    const auto* send = std::get_if<SendMessage>(&effect);
    if (send && !std::exchange(flushed, true)) handler.flush();
    if (send) handler.send(send->message);
  }
  for (const Effect& effect : effects) {
    if (const auto* log = std::get_if<LogLine>(&effect)) handler.log(*log);
  }
}

}  // namespace treeroll::learner
