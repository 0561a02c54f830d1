#pragma once

#include <string>

#include "common/transport/loop.h"
#include "learner/web/http_server.h"
#include "learner/web/page_options.h"
#include "learner/web/rollout_shower.h"
#include "learner/web/study_site.h"
#include "learner/web/views/live_study.h"

namespace treeroll::web {

/// A study's page: what is told of the study, and the server that a browser asks.
class LivePage {
 public:
  /// Listens. Throws ConfigError under --http or --http-token-file.
  /// Precondition: loop and core outlive it; the core has applied nothing yet.
  LivePage(transport::Loop& loop, const PageOptions& options, const learner::LearnerCore& core,
           StudyFacts facts, ShowingProgram program, HttpLimits limits = {});

  LiveStudy& study() { return study_; }
  /// Somebody has asked for the study's state just now.
  bool is_watched() const { return site_.is_watched(); }
  /// "http://127.0.0.1:8080/".
  std::string url() const { return server_.url(); }

 private:
  LiveStudy study_;
  RolloutShower shower_;
  StudySite site_;
  HttpServer server_;
};

}  // namespace treeroll::web
