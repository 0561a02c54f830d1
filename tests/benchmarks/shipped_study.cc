#include "tests/benchmarks/shipped_study.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/numbers/random_stream.h"
#include "learner/study/study_file.h"
#include "workers/app/task_content.h"

namespace treeroll::benchmarks {

Study shipped_study(const std::string& name, const std::vector<std::string>& overrides) {
  const std::filesystem::path studies = TREEROLL_STUDIES_DIR;
  return load_study(studies / (name + ".toml"), overrides).study;
}

Study cluster_study(const std::vector<std::string>& overrides) {
  return load_study(TREEROLL_BENCHMARK_STUDY, overrides).study;
}

std::unique_ptr<Task> task_of(const Condition& condition) {
  TaskRegistry registry;
  add_standard_tasks(registry);
  nlohmann::json resolved;
  return worker::make_task(registry, condition.task_content, resolved);
}

std::vector<Eigen::VectorXd> thetas_about(const Policy& policy, int number) {
  // Small against every number of a policy: each theta makes one.
  constexpr double kStep = 1e-3;
  std::vector<Eigen::VectorXd> thetas;
  for (int i = 0; i < number; ++i) {
    RandomStream stream(1, 0, static_cast<std::uint32_t>(i), RandomPurpose::kPerturbation);
    Eigen::VectorXd theta = policy.theta();
    for (Eigen::Index place = 0; place < theta.size(); ++place) {
      theta[place] += kStep * stream.next_normal();
    }
    thetas.push_back(std::move(theta));
  }
  return thetas;
}

}  // namespace treeroll::benchmarks
