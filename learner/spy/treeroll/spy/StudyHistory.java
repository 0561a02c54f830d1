package treeroll.spy;

import java.util.LinkedHashMap;
import java.util.LinkedHashSet;
import java.util.Map;
import java.util.Set;
import treeroll.run_status_t;

/** The runs of all learners that are heard on one channel. Not shared between threads. */
final class StudyHistory {
  /** A run is that of its learner: two studies both have a run 0. */
  record RunName(long learner, int run) {}

  /** Runs of one condition of one learner are alike, and have one colour. */
  record Group(long learner, String condition) {}

  /** Further ones are not kept: what is on the network has no bound. */
  static final int RUNS_MAX = 5000;

  /** Of all runs, 28 bytes each. */
  static final int POINTS_MAX = 1_000_000;

  private final Map<RunName, RunHistory> runs = new LinkedHashMap<>();
  private final Set<Group> groups = new LinkedHashSet<>();
  private final Set<Long> learners = new LinkedHashSet<>();
  private int points = 0;
  private boolean overflows = false;

  /** Whether there is something new to draw. */
  boolean take(run_status_t status) {
    if (!RunHistory.isSound(status)) return false;
    RunName name = new RunName(status.learner_id, status.run);
    RunHistory run = runs.get(name);
    if (run == null) {
      if (runs.size() >= RUNS_MAX) {
        overflows = true;
        return false;
      }
      run = new RunHistory(status);
      runs.put(name, run);
      groups.add(groupOf(name));
      learners.add(name.learner());
    }
    int before = run.size();
    if (!run.take(status)) return false;
    points += run.size() - before;
    if (points > POINTS_MAX) thinOut();
    return true;
  }

  /** Halves the runs that are longer than half of the mean: they have half of all points. */
  private void thinOut() {
    int limit = points / runs.size() / 2;
    points = 0;
    for (RunHistory run : runs.values()) {
      if (run.size() > limit) run.thinOut();
      points += run.size();
    }
  }

  int points() {
    return points;
  }

  Map<RunName, RunHistory> runs() {
    return runs;
  }

  /** In the order in which they were heard. */
  Set<Group> groups() {
    return groups;
  }

  Group groupOf(RunName name) {
    return new Group(name.learner(), runs.get(name).condition);
  }

  /** More runs speak than are kept. */
  boolean overflows() {
    return overflows;
  }

  /** "tree", or "tree, learner 2" where several are heard. */
  String nameOf(Group group) {
    if (learners.size() < 2) return group.condition();
    int number = 1;
    for (long learner : learners) {
      if (learner == group.learner()) break;
      ++number;
    }
    return group.condition() + ", learner " + number;
  }
}
