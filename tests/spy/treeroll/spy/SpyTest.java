package treeroll.spy;

import info.monitorenter.gui.chart.Chart2D;
import info.monitorenter.gui.chart.ITrace2D;
import java.awt.Color;
import java.awt.Component;
import java.awt.Container;
import java.awt.Graphics2D;
import java.awt.image.BufferedImage;
import java.beans.PropertyVetoException;
import java.util.ArrayList;
import java.util.List;
import javax.swing.Action;
import javax.swing.JComboBox;
import javax.swing.JDesktopPane;
import javax.swing.JInternalFrame;
import javax.swing.JLabel;
import javax.swing.SwingUtilities;
import lcm.lcm.LCM;
import lcm.spy.ChannelData;
import lcm.util.ClassDiscoverer;
import treeroll.learner_status_t;
import treeroll.rollout_key_t;
import treeroll.run_status_t;

/** Laws of what is drawn, and a picture that is drawn without a display. */
final class SpyTest {
  private static int failures = 0;

  private static void expect(boolean holds, String law) {
    if (holds) return;
    System.err.println("FAILED: " + law);
    ++failures;
  }

  private static run_status_t status(long learner, int run, String condition, int applied) {
    run_status_t status = new run_status_t();
    status.learner_id = learner;
    status.run = run;
    status.condition = condition;
    status.num_applied = applied;
    status.num_rollouts = 1_000_000;
    status.last_reward = 0.5;
    status.mean_reward = applied / 100.0;
    status.best_reward = 0.25;
    return status;
  }

  private static void runsAreNotMixed() {
    StudyHistory history = new StudyHistory();
    expect(history.take(status(1, 0, "tree", 1)), "a first status is news");
    expect(history.take(status(2, 0, "tree", 1)), "run 0 of another learner is another run");
    expect(history.take(status(1, 1, "tree", 1)), "another repetition is another run");
    expect(history.take(status(1, 2, "flat", 1)), "another condition is another run");
    expect(history.take(status(1, 0, "tree", 2)), "a run goes on");
    expect(history.runs().size() == 4, "four runs are told apart");
    expect(history.runs().get(new StudyHistory.RunName(1, 0)).size() == 2, "run 0 of learner 1");
    expect(history.runs().get(new StudyHistory.RunName(2, 0)).size() == 1, "run 0 of learner 2");
    List<String> names = new ArrayList<>();
    for (StudyHistory.Group group : history.groups()) names.add(history.nameOf(group));
    expect(
        names.equals(List.of("tree, learner 1", "tree, learner 2", "flat, learner 1")),
        "groups are named by condition and learner: " + names);
  }

  private static void whatComesAgainIsNotTaken() {
    RunHistory run = new RunHistory(status(1, 0, "tree", 0));
    expect(!run.take(status(1, 0, "tree", 0)), "before the first roll-out there is no reward");
    expect(run.take(status(1, 0, "tree", 5)), "news");
    expect(!run.take(status(1, 0, "tree", 5)), "the same again");
    expect(!run.take(status(1, 0, "tree", 4)), "one that was overtaken");
    expect(run.size() == 1, "one point is kept");
  }

  private static void nothingGrowsWithoutABound() {
    RunHistory run = new RunHistory(status(1, 0, "tree", 0));
    for (int i = 1; i <= 100_000; ++i) run.take(status(1, 0, "tree", i));
    expect(run.size() <= RunHistory.POINTS_MAX, "points are bounded: " + run.size());
    expect(run.size() >= RunHistory.POINTS_MAX / 2, "and half of them stay: " + run.size());
    expect(run.rolloutsAt(run.size() - 1) == 100_000, "the last one stays");
    for (int i = 0; i < run.size(); ++i) {
      expect(i == 0 || run.rolloutsAt(i) > run.rolloutsAt(i - 1), "in order");
      double reward = run.rewardAt(i, RunHistory.Measure.MEAN);
      expect(reward == run.rolloutsAt(i) / 100.0, "a point keeps its own reward");
    }
    StudyHistory history = new StudyHistory();
    for (int i = 0; i < StudyHistory.RUNS_MAX + 10; ++i) history.take(status(1, i, "tree", 1));
    expect(history.runs().size() == StudyHistory.RUNS_MAX, "runs are bounded");
    expect(history.overflows(), "and that is known");
  }

  private interface Fault {
    void into(run_status_t status);
  }

  private static void whatNoLearnerSaysIsRefused() {
    List<Fault> faults =
        List.of(
            status -> status.mean_reward = Double.NaN,
            status -> status.last_reward = Double.POSITIVE_INFINITY,
            status -> status.best_reward = -1e-9,
            status -> status.num_applied = Integer.MAX_VALUE,
            status -> status.num_applied = -1,
            status -> status.condition = "x".repeat(129));
    for (Fault fault : faults) {
      StudyHistory history = new StudyHistory();
      history.take(status(1, 0, "tree", 1));
      run_status_t status = status(1, 0, "tree", 2);
      fault.into(status);
      expect(
          !history.take(status), "refused: " + faults.indexOf(fault));
      expect(
          history.take(status(1, 0, "tree", 2)),
          "and the run is not silenced by it: " + faults.indexOf(fault));
    }
  }

  private static int labels(RewardChart chart, String words) {
    int found = 0;
    for (Component part : ((Container) chart.getComponent(2)).getComponents()) {
      if (part instanceof JLabel label && label.getText().contains(words)) ++found;
    }
    return found;
  }

  private static void theLegendSaysWhatIsLeftOut() {
    RewardChart chart = new RewardChart();
    String words = "more runs speak than are drawn";
    for (int i = 0; i < StudyHistory.RUNS_MAX; ++i) chart.take(status(i / 100, i, "tree", 0));
    expect(labels(chart, words) == 0, "all are drawn");
    expect(labels(chart, "tree, learner") == 20, "of many learners the first are named");
    expect(choice(chart, 1).getItemCount() == 51, "all can be chosen");
    for (int i = 0; i < 3; ++i) chart.take(status(1, StudyHistory.RUNS_MAX + i, "tree", 0));
    expect(labels(chart, words) == 1, "that there are more is said, once");
  }

  private static void allPointsAreBounded() {
    StudyHistory history = new StudyHistory();
    boolean thinned = false;
    int most = 0;
    int before = 0;
    for (int run = 0; run < 3000; ++run) { // 1.5 million
      for (int i = 1; i <= 500; ++i) {
        history.take(status(1, run, "tree", i));
        thinned |= history.points() < before;
        before = history.points();
        most = Math.max(most, history.points());
      }
    }
    expect(thinned && most <= StudyHistory.POINTS_MAX, "all points are bounded: " + most);
    int sum = 0;
    for (RunHistory run : history.runs().values()) {
      sum += run.size();
      expect(run.rolloutsAt(run.size() - 1) == 500, "the last of each run stays");
    }
    expect(sum == history.points(), "they are counted: " + sum + " " + history.points());
    expect(sum > StudyHistory.POINTS_MAX / 4, "no more are lost than must be: " + sum);
  }

  private static void ofTooManyTheNewestWait() {
    Inbox inbox = new Inbox();
    for (int i = 1; i <= Inbox.STATUSES_MAX + 5; ++i) inbox.put(status(1, 0, "tree", i));
    List<Integer> taken = new ArrayList<>();
    inbox.drain(status -> taken.add(status.num_applied));
    expect(taken.size() == Inbox.STATUSES_MAX, "what waits is bounded: " + taken.size());
    expect(taken.get(0) == 6, "the oldest are lost: " + taken.get(0));
    expect(taken.get(taken.size() - 1) == Inbox.STATUSES_MAX + 5, "the newest is not");
    inbox.drain(status -> expect(false, "what is taken waits no more"));
  }

  private static void lcmSpyFindsThePlugin() {
    List<Class<?>> found = new ArrayList<>();
    ClassDiscoverer.findClasses((jar, kind) -> found.add(kind));
    expect(found.contains(RewardPlugin.class), "lcm-spy finds the plug-in on its class path");
    expect(found.contains(run_status_t.class), "and the types");
    RewardPlugin plugin = new RewardPlugin();
    expect(plugin.canHandle(run_status_t.LCM_FINGERPRINT), "it draws runs");
    expect(!plugin.canHandle(learner_status_t.LCM_FINGERPRINT), "and nothing else");
  }

  private static void layOut(Component component) {
    component.doLayout();
    if (component instanceof Container container) {
      for (Component part : container.getComponents()) layOut(part);
    }
  }

  private static long nowMs = 0;

  private static BufferedImage picture(RewardChart chart) {
    chart.show(nowMs += 5000);
    chart.setSize(700, 500);
    layOut(chart);
    BufferedImage image = new BufferedImage(700, 500, BufferedImage.TYPE_INT_RGB);
    Graphics2D pen = image.createGraphics();
    chart.paint(pen);
    pen.dispose();
    return image;
  }

  private static int count(BufferedImage image, Color colour) {
    int found = 0;
    for (int y = 0; y < 450; ++y) { // above the legend
      for (int x = 0; x < image.getWidth(); ++x) {
        if ((image.getRGB(x, y) & 0xffffff) == (colour.getRGB() & 0xffffff)) ++found;
      }
    }
    return found;
  }

  private static int pointsDrawn(RewardChart chart) {
    int points = 0;
    for (ITrace2D trace : ((Chart2D) chart.getComponent(1)).getTraces()) points += trace.getSize();
    return points;
  }

  private static void ofManyRunsTheEnvelopeIsDrawn() {
    RewardChart chart = new RewardChart();
    for (int run = 0; run < StudyHistory.RUNS_MAX; ++run) {
      for (int i = 1; i <= 100; ++i) {
        run_status_t status = status(1, run, run % 2 == 0 ? "tree" : "flat", 10 * i);
        status.mean_reward = run == 77 && i == 50 ? 0.9 : 0.2 + 0.1 * (run % 2) + i / 1000.0;
        chart.take(status);
      }
    }
    BufferedImage picture = picture(chart);
    int points = pointsDrawn(chart);
    expect(points <= 2 * 3 * Envelope.PLACES_MAX, "half a million points become few: " + points);
    expect(points >= 2 * 3 * 100, "and no fewer than the chart can show: " + points);
    expect(count(picture, RewardChart.COLOURS[0]) > 300, "one condition");
    expect(count(picture, RewardChart.COLOURS[1]) > 300, "and the other");
    int peak = highest(picture, RewardChart.COLOURS[1]);
    expect(peak < 60, "one run's one reward is within the envelope: " + peak);
    expect(labels(chart, "lowest, mean and highest of 5000 runs") == 1, "that is said");
    choice(chart, 1).setSelectedItem(new StudyHistory.Group(1, "tree"));
    expect(count(picture(chart), RewardChart.COLOURS[1]) == 0, "a condition can be chosen");
    expect(labels(chart, "of 2500 runs") == 1, "and the words follow");
  }

  private static void manyConditionsAreBoundedToo() {
    RewardChart chart = new RewardChart();
    for (int run = 0; run < 1000; ++run) {
      for (int i = 1; i <= 3; ++i) chart.take(status(1, run, "c" + run, 1000 * i));
    }
    picture(chart);
    int points = pointsDrawn(chart);
    expect(points <= RewardChart.ENVELOPES_MAX * 3 * Envelope.PLACES_MAX, "bounded: " + points);
    expect(labels(chart, "of the newest 40") == 1, "that is said");
  }

  private static void fewRunsAreLinesWhateverWasBefore() {
    RewardChart chart = new RewardChart();
    for (int run = 0; run <= RewardChart.LINES_MAX; ++run) {
      for (int i = 1; i <= 3; ++i) chart.take(status(1, run, run == 0 ? "few" : "many", i));
      picture(chart);
      if (run < RewardChart.LINES_MAX) {
        expect(pointsDrawn(chart) == 3 * (run + 1), "a line for each: " + pointsDrawn(chart));
      }
    }
    expect(pointsDrawn(chart) == 2 * 3 * 3, "envelopes of two: " + pointsDrawn(chart));
    choice(chart, 1).setSelectedItem(new StudyHistory.Group(1, "few"));
    expect(pointsDrawn(chart) == 3, "one that is chosen is a line: " + pointsDrawn(chart));
    expect(labels(chart, "lowest") == 0, "and no word of envelopes");
  }

  private static void anEnvelopeHoldsEachReward() {
    RunHistory early = new RunHistory(status(1, 0, "tree", 0));
    RunHistory late = new RunHistory(status(1, 1, "tree", 0));
    for (int i = 1; i <= 1000; ++i) {
      run_status_t status = status(1, 0, "tree", i);
      status.mean_reward = i == 333 ? 9 : 1;
      early.take(status);
    }
    for (int i : new int[] {501, 2000}) {
      run_status_t status = status(1, 1, "tree", i);
      status.mean_reward = 3;
      late.take(status);
    }
    Envelope envelope = new Envelope(2000);
    envelope.add(early, RunHistory.Measure.MEAN);
    envelope.add(late, RunHistory.Measure.MEAN);
    expect(envelope.places() == Envelope.PLACES_MAX, "as many places as there are");
    double highest = 0;
    for (int place = 0; place < envelope.places(); ++place) {
      expect(!envelope.isEmpty(place), "both together leave no gap: " + place);
      if (envelope.rolloutsAt(place) <= 1000) highest = Math.max(highest, envelope.highestAt(place));
    }
    expect(highest == 9, "a reward between two places is not lost: " + highest);
    expect(envelope.meanAt(150) == 2, "the mean of both: " + envelope.meanAt(150));
    expect(envelope.lowestAt(150) == 1 && envelope.highestAt(150) == 3, "and their range");
    expect(envelope.meanAt(300) == 3, "of one that has ended nothing is made up");
    expect(envelope.rolloutsAt(399) == 2000, "the last place is the last roll-out");
  }

  private static JComboBox<?> choice(Container container, int number) {
    Container choices = (Container) container.getComponent(0);
    return (JComboBox<?>) choices.getComponent(number);
  }

  private static void aLineIsDrawnForEachRun() {
    RewardChart chart = new RewardChart();
    Color first = RewardChart.COLOURS[0];
    Color second = RewardChart.COLOURS[1];
    expect(count(picture(chart), first) == 0, "nothing is drawn of nothing");
    for (int i = 1; i <= 50; ++i) chart.take(status(1, 0, "tree", i));
    int alone = count(picture(chart), first);
    expect(alone > 300, "a run is a line: " + alone);
    expect(count(picture(chart), second) == 0, "in one colour");
    for (int i = 1; i <= 50; ++i) {
      run_status_t flat = status(1, 1, "flat", i);
      flat.mean_reward = 0.4 - i / 200.0;
      chart.take(flat);
    }
    expect(count(picture(chart), second) > 300, "another condition has another colour");
    choice(chart, 1).setSelectedItem(new StudyHistory.Group(1, "flat"));
    BufferedImage flat = picture(chart);
    expect(count(flat, first) == 0, "a condition that is not chosen is not shown");
    expect(count(flat, second) > 300, "the chosen one is");
    chart.take(status(2, 0, "tree", 1));
    expect(count(picture(chart), first) == 0, "a learner that comes does not change the choice");
    choice(chart, 1).setSelectedIndex(0);
    choice(chart, 0).setSelectedItem(RunHistory.Measure.LAST);
    // Both runs have the same last reward all along: the line drawn last hides the other one.
    BufferedImage last = picture(chart);
    expect(count(last, first) + count(last, second) > 300, "another measure is drawn");
    expect(count(last, first) == 0 || count(last, second) == 0, "of the same numbers, one line");
  }

  private static int highest(BufferedImage image, Color colour) {
    for (int y = 0; y < 450; ++y) {
      for (int x = 0; x < image.getWidth(); ++x) {
        if ((image.getRGB(x, y) & 0xffffff) == (colour.getRGB() & 0xffffff)) return y;
      }
    }
    return 450;
  }

  private static void aMeanThatIsNotKnownIsNotDrawn() {
    for (int unknown : new int[] {1, 30}) { // the first of a run, of a later layer
      RewardChart chart = new RewardChart();
      Color colour = RewardChart.COLOURS[0];
      for (int i = 1; i <= 60; ++i) {
        run_status_t status = status(1, 0, "tree", i);
        status.num_switches = i < 30 ? 0 : 1;
        status.mean_reward = i == unknown ? 0 : 0.9 + i / 1000.0;
        chart.take(status);
      }
      BufferedImage picture = picture(chart);
      expect(count(picture, colour) > 300, "the known ones are drawn");
      int row = highest(picture, colour);
      expect(row < 150, "to the scale of what is known, not in a corner: " + row);
    }
  }

  private static double meanOf(RunHistory run, int applied, int switches, double mean, double last) {
    run_status_t status = status(1, 0, "tree", applied);
    status.num_switches = switches;
    status.mean_reward = mean;
    status.last_reward = last;
    run.take(status);
    return run.rewardAt(run.size() - 1, RunHistory.Measure.MEAN);
  }

  private static void aMeanOfZerosIsKnown() {
    RunHistory run = new RunHistory(status(1, 0, "tree", 0));
    expect(Double.isNaN(meanOf(run, 1, 0, 0, 0)), "one reward has no mean");
    expect(meanOf(run, 2, 0, 0, 0) == 0, "two failed roll-outs have: 0");
    expect(meanOf(run, 3, 0, 0.5, 0.5) == 0.5, "a mean");
    expect(meanOf(run, 4, 0, 0, 0.5) == 0, "a 0 within a layer is a mean");
    expect(Double.isNaN(meanOf(run, 5, 1, 0, 0.5)), "a layer begins");
    expect(Double.isNaN(meanOf(run, 6, 1, 0, 0)), "the last layer's late failure is no mean");
    expect(meanOf(run, 7, 1, 0.5, 0.5) == 0.5, "the layer's first mean");
    expect(meanOf(run, 8, 1, 0, 0) == 0, "and one of 0");
  }

  /** What a right click in lcm-spy does, over a network within this process. */
  private static void thePluginDrawsWhatComesAndLeavesWithItsWindow() throws Exception {
    ChannelData channel = new ChannelData();
    channel.name = "REPLAYED_TREEROLL_RUNS";
    JDesktopPane desktop = new JDesktopPane();
    Action action = new RewardPlugin().getAction(desktop, channel);
    expect(action.getValue(Action.NAME).equals("Reward by run"), "its name in the menu");
    int before = LCM.getSingleton().getNumSubscriptions();
    SwingUtilities.invokeAndWait(() -> action.actionPerformed(null));
    JInternalFrame frame = desktop.getAllFrames()[0];
    RewardChart chart = (RewardChart) frame.getContentPane().getComponent(0);
    for (int i = 1; i <= 50; ++i) LCM.getSingleton().publish(channel.name, status(1, 0, "tree", i));
    LCM.getSingleton().publish(channel.name, new rollout_key_t());
    LCM.getSingleton().publish("TREEROLL_RUNS", status(1, 1, "flat", 1));
    int[] drawn = {0};
    for (int tries = 0; tries < 200 && drawn[0] < 300; ++tries) {
      Thread.sleep(20);
      SwingUtilities.invokeAndWait(
          () -> drawn[0] = count(picture(chart), RewardChart.COLOURS[0]));
    }
    expect(drawn[0] > 300, "what comes on its channel is drawn: " + drawn[0]);
    expect(count(picture(chart), RewardChart.COLOURS[1]) == 0, "what comes on another is not");
    SwingUtilities.invokeAndWait(
        () -> {
          try {
            frame.setClosed(true);
          } catch (PropertyVetoException never) {
            throw new IllegalStateException(never);
          }
        });
    expect(LCM.getSingleton().getNumSubscriptions() == before, "a window that is closed is gone");
  }

  public static void main(String[] arguments) throws Exception {
    runsAreNotMixed();
    aMeanThatIsNotKnownIsNotDrawn();
    aMeanOfZerosIsKnown();
    whatNoLearnerSaysIsRefused();
    theLegendSaysWhatIsLeftOut();
    allPointsAreBounded();
    ofTooManyTheNewestWait();
    thePluginDrawsWhatComesAndLeavesWithItsWindow();
    whatComesAgainIsNotTaken();
    nothingGrowsWithoutABound();
    lcmSpyFindsThePlugin();
    aLineIsDrawnForEachRun();
    anEnvelopeHoldsEachReward();
    ofManyRunsTheEnvelopeIsDrawn();
    manyConditionsAreBoundedToo();
    fewRunsAreLinesWhateverWasBefore();
    System.exit(failures > 0 ? 1 : 0); // Swing would wait for events
  }
}
