#include "learner/core/carry_out.h"

namespace treeroll {

void carry_out(const LearnerEffects& effects, EffectHandler& handler) {
  for (const AcceptedResult& result : effects.accepted) handler.append(result);
  if (effects.time) handler.append(*effects.time);
  if (!effects.accepted.empty() || effects.time) handler.flush();
  for (const protocol::Message& message : effects.send) handler.send(message);
  for (const LogLine& line : effects.log) handler.log(line);
}

}  // namespace treeroll
