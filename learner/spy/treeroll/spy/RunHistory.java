package treeroll.spy;

import java.util.Arrays;
import treeroll.run_status_t;

/** The rewards of one run, as its statuses tell them, over the roll-outs applied so far. */
final class RunHistory {
  /** What can be drawn of a status. */
  enum Measure {
    MEAN("mean reward of the window"),
    LAST("reward of the last roll-out"),
    BEST("best reward so far");

    private final String words;

    Measure(String words) {
      this.words = words;
    }

    double of(run_status_t status) {
      return switch (this) {
        case MEAN -> status.mean_reward;
        case LAST -> status.last_reward;
        case BEST -> status.best_reward;
      };
    }

    @Override
    public String toString() {
      return words;
    }
  }

  /** A run of more statuses keeps every second one: no run grows without a bound. */
  static final int POINTS_MAX = 2000;
  /** As common/protocol/limits.h has it. */
  private static final int NAME_LENGTH_MAX = 128;

  final String condition;
  private int[] rollouts = new int[16];
  private final double[][] rewards = new double[Measure.values().length][16];
  private int size = 0;
  private int timesThinned = 0;
  private int switches = -1;
  private boolean knowsMean = false;

  RunHistory(run_status_t first) {
    condition = first.condition;
  }

  /** Whether it can be of a learner: anybody may speak on the network. */
  static boolean isSound(run_status_t status) {
    for (Measure measure : Measure.values()) {
      double reward = measure.of(status);
      if (!(reward >= 0 && reward <= Double.MAX_VALUE)) return false; // NaN is neither
    }
    return status.num_applied >= 0
        && status.num_applied <= status.num_rollouts
        && status.condition.length() <= NAME_LENGTH_MAX;
  }

  /**
   * Takes a sound status. One that comes again, or late, is not taken: a run never goes back.
   *
   * @return whether there is something new to draw
   */
  boolean take(run_status_t status) {
    if (status.num_applied < 1 || (size > 0 && status.num_applied <= rollouts[size - 1])) {
      return false;
    }
    if (size == POINTS_MAX) thinOut();
    if (size == rollouts.length) grow();
    rollouts[size] = status.num_applied;
    for (Measure measure : Measure.values()) rewards[measure.ordinal()][size] = measure.of(status);
    if (!isMeanKnown(status)) rewards[Measure.MEAN.ordinal()][size] = Double.NaN;
    ++size;
    return true;
  }

  /**
   * The message has no word for a mean that is not known: 0. That is so while the window, which each
   * layer begins anew, has fewer than two rewards. In the first layer it has all that were applied;
   * later a 0 is not believed before another mean has come.
   */
  private boolean isMeanKnown(run_status_t status) {
    if (status.num_switches != switches) {
      switches = status.num_switches;
      knowsMean = false;
    }
    knowsMean |= status.mean_reward > 0 || (switches == 0 && status.num_applied >= 2);
    return knowsMean;
  }

  int size() {
    return size;
  }

  /** Roll-outs applied when status number i came. */
  int rolloutsAt(int i) {
    return rollouts[i];
  }

  /** NaN: not known. */
  double rewardAt(int i, Measure measure) {
    return rewards[measure.ordinal()][i];
  }

  /** What has been drawn of it is to be drawn anew once this has grown. */
  int timesThinned() {
    return timesThinned;
  }

  private void grow() {
    int room = Math.min(2 * size, POINTS_MAX);
    rollouts = Arrays.copyOf(rollouts, room);
    for (int m = 0; m < rewards.length; ++m) rewards[m] = Arrays.copyOf(rewards[m], room);
  }

  /** Keeps every second one, and the last. */
  void thinOut() {
    int kept = 0;
    for (int i = 1 - size % 2; i < size; i += 2) {
      rollouts[kept] = rollouts[i];
      for (double[] of : rewards) of[kept] = of[i];
      ++kept;
    }
    size = kept;
    ++timesThinned;
  }
}
