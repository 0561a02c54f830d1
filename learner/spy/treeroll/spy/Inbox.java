package treeroll.spy;

import java.util.ArrayList;
import java.util.List;
import java.util.concurrent.ArrayBlockingQueue;
import java.util.function.Consumer;
import treeroll.run_status_t;

/**
 * From LCM's thread to Swing's. Of more than can be drawn the newest stay: a window lags by no more
 * than what is in here.
 */
final class Inbox {
  static final int STATUSES_MAX = 10_000;

  private final ArrayBlockingQueue<run_status_t> waiting = new ArrayBlockingQueue<>(STATUSES_MAX);

  /** In one thread. */
  void put(run_status_t status) {
    while (!waiting.offer(status)) waiting.poll();
  }

  /** What waits now, oldest first. */
  void drain(Consumer<run_status_t> take) {
    List<run_status_t> statuses = new ArrayList<>();
    waiting.drainTo(statuses);
    statuses.forEach(take);
  }
}
