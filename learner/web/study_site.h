#pragma once

#include <functional>
#include <list>
#include <memory>
#include <string>

#include "learner/web/http_message.h"
#include "learner/web/rollout_shower.h"
#include "learner/web/views/live_study.h"

namespace treeroll::web {

/// What a page's addresses lead to:
///   /  /page.css ..             the page
///   /api/study                  what does not change
///   /api/state  /api/curves     what does
///   /api/conditions/C           how a condition begins
///   /api/runs?condition=&order=&from=          /api/runs/R
///   /api/rollouts?condition=&run=&layer=&status=&reward_min=&order=&from=
///   /api/rollouts/R/N           a roll-out step by step; 202 while it is being made
///   /metrics  /healthz
/// A text is built at most a few times a second, for however many browsers.
class StudySite {
 public:
  /// Precondition: all outlive it.
  StudySite(LiveStudy& study, RolloutShower& shower, std::function<TimePoint()> now);

  HttpResponse answer(const HttpRequest& request);

  /// A page has asked for the study's state just now.
  bool is_watched() const;

 private:
  struct Built {
    std::string address;
    HttpResponse response;
    std::int64_t version = 0;
    TimePoint at;
  };
  HttpResponse built(const HttpRequest& request, const std::function<std::string()>& build);
  HttpResponse rollout(const std::string& rest);

  LiveStudy& study_;
  RolloutShower& shower_;
  std::function<TimePoint()> now_;
  TimePoint state_asked_at_{};
  std::list<Built> built_;  ///< used last in front
};

}  // namespace treeroll::web
