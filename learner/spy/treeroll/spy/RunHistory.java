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

    /** NaN for a mean that is not known yet, at the start of a layer: its window has no reward. */
    double of(run_status_t status) {
      return switch (this) {
        case MEAN -> status.mean_reward > 0 || status.last_reward == 0
            ? status.mean_reward
            : Double.NaN; // the message has no word for it: 0
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

  final String condition;
  final int repetition;
  private int[] rollouts = new int[16];
  private final double[][] rewards = new double[Measure.values().length][16];
  private int size = 0;
  private boolean done = false;

  RunHistory(run_status_t first) {
    condition = first.condition;
    repetition = first.repetition;
  }

  /**
   * Takes a status. One that comes again, or late, is not taken: a run never goes back.
   *
   * @return whether there is something new to draw
   */
  boolean take(run_status_t status) {
    done |= status.done;
    if (status.num_applied < 1 || (size > 0 && status.num_applied <= rollouts[size - 1])) {
      return false;
    }
    if (size == POINTS_MAX) thinOut();
    if (size == rollouts.length) grow();
    rollouts[size] = status.num_applied;
    for (Measure measure : Measure.values()) rewards[measure.ordinal()][size] = measure.of(status);
    ++size;
    return true;
  }

  int size() {
    return size;
  }

  boolean isDone() {
    return done;
  }

  /** Roll-outs applied when status number i came. */
  int rolloutsAt(int i) {
    return rollouts[i];
  }

  double rewardAt(int i, Measure measure) {
    return rewards[measure.ordinal()][i];
  }

  private void grow() {
    int room = Math.min(2 * size, POINTS_MAX);
    rollouts = Arrays.copyOf(rollouts, room);
    for (int m = 0; m < rewards.length; ++m) rewards[m] = Arrays.copyOf(rewards[m], room);
  }

  /** The last one stays. */
  private void thinOut() {
    int kept = 0;
    for (int i = 1; i < size; i += 2) {
      rollouts[kept] = rollouts[i];
      for (double[] of : rewards) of[kept] = of[i];
      ++kept;
    }
    size = kept;
  }
}
