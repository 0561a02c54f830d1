#include "learner/core/carry_out.h"

namespace treeroll::learner {

void carry_out(const Effects& effects, EffectHandler& handler) {
  bool appended = false;
  for (const Effect& effect : effects) {
    const auto* result = std::get_if<AppendResult>(&effect);
    const auto* worker = std::get_if<AppendWorker>(&effect);
    const auto* time = std::get_if<AppendTime>(&effect);
    if (result) handler.append(result->result);
    if (worker) handler.append(worker->worker);
    if (time) handler.append(time->time);
    appended = appended || result || worker || time;
  }
  if (appended) handler.flush();
  for (const Effect& effect : effects) {
    if (const auto* send = std::get_if<SendMessage>(&effect)) handler.send(send->message);
  }
  for (const Effect& effect : effects) {
    if (const auto* log = std::get_if<LogLine>(&effect)) handler.log(*log);
  }
}

}  // namespace treeroll::learner
