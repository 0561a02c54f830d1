#include "tests/simulation/scenario.h"

#include <algorithm>
#include <array>

#include "tests/explore/trees.h"
#include "tests/simulation/dice.h"

namespace treeroll::simulation {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

enum Purpose : std::uint32_t {
  kStudyDice = 1,
  kFaultDice = 2,
  kNeighbourDice = 5,
  kTimeDice = 6,
  kLimitDice = 7,
  kDyingDice = 8,
  kSizeDice = 9,
  kLastingDice = 10,
  kWorthDice = 11,
  kRelayDice = 12,
  kStrangerShareDice = 13,
  kRecheckDice = 14
};

/// A tree of two or three layers, most of them left as soon as they may be.
Condition quick_condition(Dice& dice, int index) {
  const bool is_deep = dice.chance(.2);
  Condition condition{"condition" + std::to_string(index), kTaskContent,
                      std::make_shared<TreePolicy>(
                          is_deep ? explore::three_layer_tree() : explore::two_layer_tree(), 1,
                          ThetaLayout::kMeans),
                      explore::settings_for_means()};
  explore::ExplorationSettings& exploration = condition.exploration;
  exploration.num_rollouts = is_deep ? dice.between(28, 36) : dice.between(14, 30);
  explore::PowerSettings power;
  power.first_update = dice.between(2, 4);
  power.best_considered = dice.between(1, power.first_update);
  exploration.rule = power;
  exploration.convergence_window = dice.between(3, 6);
  exploration.convergence_slope = dice.chance(.8) ? kAnySlope : .01;
  exploration.last_layer = condition.start->num_layers();
  exploration.reuse = dice.chance(.5);
  return condition;
}

Study drawn_study(std::uint64_t seed, Dice& dice) {
  Study study;
  study.name = "simulated";
  study.seed = seed;
  study.repetitions = dice.between(1, 3);
  study.in_sequence = dice.chance(.6);
  const int in_flight = dice.between(1, 4);
  const int num_conditions = study.repetitions == 1 ? 2 : dice.between(1, 2);
  for (int i = 0; i < num_conditions; ++i) {
    study.conditions.push_back(quick_condition(dice, i));
    study.conditions.back().exploration.in_flight = in_flight;
  }
  return study;
}

/// How long the work takes without faults, roughly.
Duration expected_length(const Scenario& scenario) {
  int longest = 0;
  for (const Study& study : scenario.studies) {
    for (const Condition& condition : study.conditions) {
      longest = std::max(longest, condition.exploration.num_rollouts);
    }
  }
  int evaluators = 0;
  for (const WorkerPlan& worker : scenario.workers) evaluators += worker.num_evaluators;
  const int in_a_row = std::max(longest, num_rollouts(scenario) / std::max(1, evaluators));
  const Duration each = (scenario.task.duration_min + scenario.task.duration_max) / 2 +
                        scenario.network.delay_min + scenario.network.delay_max;
  return std::max<Duration>(milliseconds(100), in_a_row * each);
}

void draw_task_faults(Dice& dice, TaskBehaviour& task) {
  if (dice.chance(.3)) task.crashing = .04;
  if (dice.chance(.2)) task.hanging = .03;
  if (dice.chance(.3)) task.diverging = .1;
  if (dice.chance(.3)) task.flaky = .06;
}

void draw_network_faults(Dice& dice, NetworkFaults& network) {
  if (dice.chance(.7)) network.loss = dice.chance(.5) ? .1 : dice.between(.01, .4);
  if (dice.chance(.5)) network.duplication = dice.between(.02, .3);
  if (dice.chance(.3)) network.truncation = .02;
  if (dice.chance(.4)) network.straggling = dice.between(.01, .1);
  network.reorders = dice.chance(.6);
  if (dice.chance(.3)) network.delay_max = milliseconds(dice.between(1, 60));
}

void draw_incidents(Dice& dice, Scenario& scenario, Duration length) {
  using Kind = Incident::Kind;
  struct Habit {
    Kind kind;
    double probability;
    int count_max;
    Duration length_max;
  };
  const std::array<Habit, 8> habits = {{{Kind::kWorkerCrash, .5, 3, seconds(4)},
                                        {Kind::kWorkerDrain, .3, 2, seconds(1)},
                                        {Kind::kWorkerStop, .3, 2, seconds(5)},
                                        {Kind::kPartition, .4, 3, seconds(6)},
                                        {Kind::kEvaluatorsKilled, .4, 4, Duration{}},
                                        {Kind::kLearnerCrash, .5, 4, seconds(3)},
                                        {Kind::kLearnerExit, .25, 2, seconds(2)},
                                        {Kind::kLearnerStop, .2, 1, seconds(5)}}};
  for (const Habit& habit : habits) {
    if (!dice.chance(habit.probability)) continue;
    const int count = dice.between(1, habit.count_max);
    for (int i = 0; i < count; ++i) {
      Incident incident{.kind = habit.kind, .time = {}, .length = {}};
      incident.time = TimePoint(dice.between(Duration{}, 2 * length));
      const Duration length_max = dice.chance(.5)
                                      ? std::min<Duration>(habit.length_max, milliseconds(100))
                                      : habit.length_max;
      incident.length = dice.between(Duration{}, length_max);
      const std::size_t num_slots =
          incident.befalls_learner() ? scenario.studies.size() : scenario.workers.size();
      incident.slot = dice.between(0, static_cast<int>(num_slots) - 1);
      scenario.incidents.push_back(incident);
    }
  }
}

/// Policies of many pieces; the thetas of the last layer are larger than a frame.
void make_large(Dice& dice, Study& study) {
  const int num_last = dice.between(84, 100);
  const PolicyPtr start = wide_policy(num_last / 4, num_last);
  for (Condition& condition : study.conditions) {
    condition.start = start;
    condition.exploration.last_layer = start->num_layers();
    condition.exploration.num_rollouts = std::min(condition.exploration.num_rollouts, 16);
  }
}

/// What does not end by itself: one host of several, or one learner of two, for ever.
void draw_lasting_fault(Dice& dice, Scenario& scenario) {
  using Kind = Incident::Kind;
  Incident incident{
      .kind = Kind::kPlayback, .time = {}, .length = {}, .speed = dice.chance(.5) ? 1. : 10.};
  const int num_workers = static_cast<int>(scenario.workers.size());
  const int num_learners = static_cast<int>(scenario.studies.size());
  const int kind = dice.between(0, 3);
  if (kind == 1 && num_workers > 1) {
    incident.kind = Kind::kWorkerDeaf;
    incident.slot = dice.between(0, num_workers - 1);
  } else if (kind == 2 && num_workers > 1) {
    incident.kind = Kind::kEvaluatorsStuck;
    incident.slot = dice.between(0, num_workers - 1);
    scenario.task.hanging = 0;  // hours of it would tell nothing
    scenario.task.time_limit = std::chrono::hours(1);
  } else if (kind == 3 && num_learners > 1) {
    incident.kind = Kind::kLearnerDies;
    incident.slot = dice.between(0, num_learners - 1);
    scenario.task.hanging = 0;
    scenario.task.time_limit = std::chrono::hours(1);
    scenario.task.duration_min = seconds(5);
    scenario.task.duration_max = seconds(20);
    for (Study& study : scenario.studies) study.repetitions = 1;
  }
  incident.time = TimePoint(dice.between(Duration{}, expected_length(scenario)));
  scenario.incidents.push_back(incident);
}

}  // namespace

PolicyPtr wide_policy(int num_first, int num_last) {
  std::vector<int> parents;
  for (int i = 0; i < num_last; ++i) parents.push_back(i * num_first / num_last);
  return std::make_shared<TreePolicy>(
      TreeModel::from_global(FrameKind::kCholesky,
                             {explore::spaced_gmm(num_first), explore::spaced_gmm(num_last)},
                             {{}, parents}),
      1, ThetaLayout::kMeans);
}

Scenario calm_scenario(std::uint64_t seed) {
  Dice dice(seed, kStudyDice);
  Scenario scenario;
  scenario.seed = seed;
  scenario.studies = {drawn_study(seed, dice)};
  scenario.knows_task = dice.chance(.5);
  scenario.batch_bytes_max = dice.chance(.5) ? 1400 : 60000;
  if (dice.chance(.7)) {
    scenario.task.duration_min = milliseconds(dice.between(1, 60));
    scenario.task.duration_max = 2 * scenario.task.duration_min;
  }
  Dice size(seed, kSizeDice);
  if (size.chance(.03)) make_large(size, scenario.studies[0]);
  scenario.network.delay_min = microseconds(dice.between(20, 500));
  scenario.network.delay_max = 3 * scenario.network.delay_min;
  const int num_workers = dice.between(1, 4);
  for (int i = 0; i < num_workers; ++i) {
    scenario.workers.push_back({TimePoint{}, dice.chance(.3) ? 16 : dice.between(1, 4)});
  }
  scenario.reading_delay = microseconds(dice.between(0, 300));
  scenario.sync_delay = dice.chance(.3) ? Duration{} : microseconds(dice.between(100, 8000));
  scenario.load_time = microseconds(dice.between(50, 2000));
  return scenario;
}

Scenario scenario_of(std::uint64_t seed) {
  Scenario scenario = calm_scenario(seed);
  Dice dice(seed, kFaultDice);
  if (dice.chance(.25)) {
    Dice neighbour(seed, kNeighbourDice);
    scenario.studies.push_back(drawn_study(seed + 1, neighbour));
  }
  draw_task_faults(dice, scenario.task);
  draw_network_faults(dice, scenario.network);
  Dice lasting(seed, kLastingDice);
  if (lasting.chance(.15)) draw_lasting_fault(lasting, scenario);
  const Duration length = expected_length(scenario);
  if (dice.chance(.4)) {
    for (WorkerPlan& worker : scenario.workers) {
      if (dice.chance(.5)) worker.joins = TimePoint(dice.between(Duration{}, length));
    }
  }
  if (dice.chance(.2)) scenario.load_time = milliseconds(dice.between(2, 100));
  draw_incidents(dice, scenario, length);
  Dice limit(seed, kLimitDice);
  if (limit.chance(.25)) scenario.unsynced_results_max = limit.between(1, 4);
  Dice time(seed, kTimeDice);
  if (time.chance(.25)) {
    for (Study& study : scenario.studies) study.stop_after = time.between(Duration{1}, length);
  }
  Dice worth(seed, kWorthDice);
  if (worth.chance(.25)) scenario.task.discarding = worth.between(.02, .3);
  for (Study& study : scenario.studies) {
    study.discards_max = worth.between(0, 4);
    if (worth.chance(.25)) study.final_evaluations = worth.between(2, 4);
  }
  Dice dying(seed, kDyingDice);
  if (dying.chance(.2)) {
    scenario.incidents.push_back(
        {.kind = Incident::Kind::kEvaluatorsDying,
         .time = TimePoint(dying.between(Duration{}, length)),
         .length = dying.between(Duration{}, 2 * length),
         .slot = dying.between(0, static_cast<int>(scenario.workers.size()) - 1)});
  }
  scenario.faults_end = TimePoint(3 * length);
  for (const Incident& incident : scenario.incidents) {
    scenario.faults_end = std::max(scenario.faults_end, incident.time + incident.length);
  }
  return scenario;
}

Scenario with_relays(Scenario scenario) {
  using Kind = Incident::Kind;
  Dice dice(scenario.seed, kRelayDice);
  scenario.num_relays = dice.between(1, 2);
  for (WorkerPlan& worker : scenario.workers) {
    worker.relay = dice.chance(.15) ? -1 : dice.between(0, scenario.num_relays - 1);
  }
  if (scenario.faults_end == TimePoint{}) return scenario;
  const Duration length = expected_length(scenario);
  for (const Kind kind : {Kind::kRelayCrash, Kind::kRelayDrain, Kind::kRelayStop}) {
    const int count = dice.chance(.4) ? dice.between(1, 3) : 0;
    for (int i = 0; i < count; ++i) {
      const Duration length_max = dice.chance(.5) ? seconds(4) : milliseconds(100);
      const Incident incident{.kind = kind,
                              .time = TimePoint(dice.between(Duration{}, 2 * length)),
                              .length = dice.between(Duration{}, length_max),
                              .slot = dice.between(0, scenario.num_relays - 1)};
      scenario.faults_end = std::max(scenario.faults_end, incident.time + incident.length);
      scenario.incidents.push_back(incident);
    }
  }
  return scenario;
}

Scenario with_keys(Scenario scenario) {
  scenario.has_keys = true;
  Dice dice(scenario.seed, kStrangerShareDice);
  scenario.stranger_share = dice.chance(.2) ? 0 : dice.between(.01, .3);
  return scenario;
}

Scenario with_rechecks(Scenario scenario) {
  Dice dice(scenario.seed, kRecheckDice);
  for (Study& study : scenario.studies) study.recheck = dice.between(.05, 1.);
  scenario.workers_per_host = Dice(scenario.seed, kRecheckDice, 2).between(1, 3) == 1 ? 2 : 1;
  return scenario;
}

Scenario with_liar(Scenario scenario) {
  scenario = with_rechecks(std::move(scenario));
  while (scenario.workers.size() < 3) scenario.workers.push_back({TimePoint{}, 2});
  Dice dice(scenario.seed, kRecheckDice, 1);
  scenario.liar = dice.between(0, static_cast<int>(scenario.workers.size()) - 1);
  scenario.lying_share = dice.between(.05, 1.);
  return scenario;
}

int num_rollouts(const Study& study) {
  int sum = 0;
  for (const Condition& condition : study.conditions) {
    sum += condition.exploration.num_rollouts * study.repetitions;
  }
  return sum;
}

int num_rollouts(const Scenario& scenario) {
  int sum = 0;
  for (const Study& study : scenario.studies) sum += num_rollouts(study);
  return sum;
}

int num_runs(const Scenario& scenario) {
  int sum = 0;
  for (const Study& study : scenario.studies) sum += study.num_runs();
  return sum;
}

int num_in_flight(const Study& study) {
  int sum = 0;
  for (const Condition& condition : study.conditions) {
    sum += condition.exploration.in_flight * study.repetitions;
  }
  return sum;
}

const Condition& condition_of(const Study& study, int run) {
  return study.conditions[static_cast<std::size_t>(run / study.repetitions)];
}

}  // namespace treeroll::simulation
