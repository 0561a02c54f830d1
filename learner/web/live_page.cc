#include "learner/web/live_page.h"

#include "common/base/config_error.h"

namespace treeroll::web {
namespace {

constexpr const char* kAddressOption = "--http";
constexpr const char* kTokenOption = "--http-token-file";

HttpAccess access_of(const PageOptions& options, const std::string& host_name) {
  HttpAccess access{.token = {}, .host_name = host_name};
  if (!options.token_file.empty()) {
    access.token = read_token_file(kTokenOption, options.token_file);
  } else if (!read_http_address(kAddressOption, options.address).is_loopback()) {
    throw ConfigError(kAddressOption, options.address,
                      "needs --http-token-file where other hosts can reach it");
  }
  return access;
}

}  // namespace

LivePage::LivePage(transport::Loop& loop, const PageOptions& options,
                   const learner::LearnerCore& core, StudyFacts facts, ShowingProgram program,
                   HttpLimits limits)
    : study_(core, std::move(facts)),
      shower_(loop, std::move(program)),
      site_(study_, shower_, [&loop] { return loop.now(); }),
      server_(
          loop, kAddressOption, read_http_address(kAddressOption, options.address),
          access_of(options, study_.facts().host_name),
          [this](const HttpRequest& request) { return site_.answer(request); }, limits) {}

}  // namespace treeroll::web
