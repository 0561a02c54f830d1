package treeroll.spy;

import java.util.Arrays;

/**
 * What many runs have come to: the lowest, the mean and the highest reward at each of some places
 * along the roll-outs. However many runs there are, so many points are drawn of them.
 */
final class Envelope {
  /** No chart is much wider, in pixels. */
  static final int PLACES_MAX = 400;

  private final int rolloutsMax;
  private final double[] lowest;
  private final double[] highest;
  private final double[] sums;
  private final int[] counts;

  /** @param rolloutsMax at least 1: where the last place is */
  Envelope(int rolloutsMax) {
    this.rolloutsMax = rolloutsMax;
    int places = Math.min(rolloutsMax, PLACES_MAX);
    lowest = new double[places];
    highest = new double[places];
    sums = new double[places];
    counts = new int[places];
    Arrays.fill(lowest, Double.POSITIVE_INFINITY);
    Arrays.fill(highest, Double.NEGATIVE_INFINITY);
  }

  /** A run counts from its first status to its last; between two of them as the earlier one. */
  void add(RunHistory run, RunHistory.Measure measure) {
    double reward = Double.NaN;
    int next = 0;
    while (next < run.size()) {
      int place = placeOf(run.rolloutsAt(next));
      // No reward is lost between two places: each is within the lowest and the highest.
      for (; next < run.size() && placeOf(run.rolloutsAt(next)) == place; ++next) {
        reward = run.rewardAt(next, measure);
        widen(place, reward);
      }
      int end = next < run.size() ? placeOf(run.rolloutsAt(next)) : place + 1;
      for (; place < end; ++place) count(place, reward);
    }
  }

  private int placeOf(int rollouts) {
    return (int) ((long) (rollouts - 1) * lowest.length / rolloutsMax);
  }

  private void widen(int place, double reward) {
    if (Double.isNaN(reward)) return;
    lowest[place] = Math.min(lowest[place], reward);
    highest[place] = Math.max(highest[place], reward);
  }

  private void count(int place, double reward) {
    if (Double.isNaN(reward)) return;
    widen(place, reward);
    sums[place] += reward;
    ++counts[place];
  }

  int places() {
    return lowest.length;
  }

  /** Roll-outs applied at a place: the last ones that belong to it. */
  double rolloutsAt(int place) {
    return (double) (place + 1) * rolloutsMax / lowest.length;
  }

  /** No run has got there, or of none is known what it came to. */
  boolean isEmpty(int place) {
    return counts[place] == 0;
  }

  double lowestAt(int place) {
    return lowest[place];
  }

  double meanAt(int place) {
    return sums[place] / counts[place];
  }

  double highestAt(int place) {
    return highest[place];
  }
}
